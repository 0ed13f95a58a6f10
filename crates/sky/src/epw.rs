//! Weather files of EnergyPlus (EPW): eight lines of header, then a line for each hour.
//!
//! *EnergyPlus Auxiliary Programs*, "Weather Converter": hour 1 is from 0:00 to 1:00 of the clock of the site, without summer time.
//! Radiation is that of the hour before the time named, so that the sun stands where it is half an hour earlier.

use std::str::FromStr;

use thiserror::Error;

use crate::perez::Conditions;
use crate::sun::{Site, SunPosition};

/// The rule that a file breaks: line, problem, reason, remedy.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{line}: {problem}")]
pub struct MalformedWeather {
    /// The line, from 1.
    pub line: usize,
    /// Problem, reason and remedy.
    pub problem: String,
}

/// Lines of the header.
const HEADER: usize = 8;

/// The fields that are read of an hour, of 35.
const FIELDS: usize = 16;

/// From this number on a value of radiation is missing.
const MISSING: f64 = 9999.0;

/// Direct radiation of a sun that shines [W/m²].
const SHINES: f64 = 100.0;

/// So low in the middle of an hour the sun does not rise in it [°]: it moves by 15° an hour at most, and air lifts it by less than one.
const HIDDEN: f64 = -10.0;

/// The dew point where a file has none [°C]: `gendaymtx`'s.
const DEW_POINT: f64 = 11.0;

/// A file of weather.
#[derive(Clone, Debug, PartialEq)]
pub struct Weather {
    /// The name of the place.
    pub city: String,
    /// The place.
    pub site: Site,
    /// Hour by hour.
    pub hours: Vec<WeatherHour>,
    /// The month and the day that the header ends with, where it says so.
    pub last_day: Option<[u32; 2]>,
}

/// An hour of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeatherHour {
    /// The month, from 1.
    pub month: u32,
    /// The day of the month, from 1.
    pub day: u32,
    /// The hour that it ends [h], 1 … 24.
    pub hour: u32,
    /// The sun at the middle of the hour, its light and that of the sky.
    pub conditions: Conditions,
}

impl Weather {
    /// Reads a file.
    ///
    /// # Errors
    /// The first line that is malformed, and why.
    pub fn read(bytes: &[u8]) -> Result<Self, MalformedWeather> {
        let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes));
        let lines: Vec<&str> = text.lines().collect();
        let (city, site) = location(lines.first().copied().unwrap_or_default())?;
        if let Some(periods) = lines.get(HEADER - 1) {
            check_periods(periods)?;
        }
        let rows = (1..).zip(&lines).skip(HEADER).filter(|(_, row)| !row.trim().is_empty());
        let hours: Vec<WeatherHour> =
            rows.map(|(line, row)| hour(line, row, &site)).collect::<Result<_, _>>()?;
        if hours.is_empty() {
            return Err(at(
                lines.len().max(1),
                "the file ends before the first hour (eight lines of header, then the hours); give a whole EPW file",
            ));
        }
        let last_day = lines.get(HEADER - 1).and_then(|periods| last_day(periods));
        Ok(Weather { city, site, hours, last_day })
    }

    /// The hours in which the sun shines far below the horizon, where there are more than by chance: place, time zone and hours do not agree.
    pub fn hours_of_hidden_sun(&self) -> Option<usize> {
        let is_hidden =
            |hour: &&WeatherHour| hour.conditions.direct >= SHINES && hour.conditions.altitude < HIDDEN;
        let hours = self.hours.iter().filter(is_hidden).count();
        (hours > self.hours.len() / 1000).then_some(hours)
    }

    /// The days, as month and day, on which the file ends and on which it ought to by its header, where it ends before: it was cut off.
    pub fn cut(&self) -> Option<[[u32; 2]; 2]> {
        let ends = self.hours.last().map(|hour| [hour.month, hour.day])?;
        self.last_day.filter(|last| ends < *last).map(|last| [ends, last])
    }
}

fn at(line: usize, problem: impl Into<String>) -> MalformedWeather {
    MalformedWeather { line, problem: problem.into() }
}

fn location(line: &str) -> Result<(String, Site), MalformedWeather> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    if fields.first().is_none_or(|word| !word.eq_ignore_ascii_case("LOCATION")) {
        return Err(at(
            1,
            "the first line does not begin with LOCATION (that of an EPW file does); give an EPW file",
        ));
    }
    let number = |place: usize, what: &str, most: f64| {
        let field = fields.get(place).copied().unwrap_or_default();
        let value = f64::from_str(field).ok().filter(|value| value.abs() <= most);
        value.ok_or_else(|| at(1, format!("{field:?} stands for the {what} (field {}), which is a number within ±{most}; correct it", place + 1)))
    };
    let site = Site {
        latitude: number(6, "latitude", 90.0)?,
        longitude: number(7, "longitude", 180.0)?,
        time_zone: number(8, "time zone", 14.0)?,
        elevation: number(9, "elevation", 9999.9)?,
    };
    Ok((fields[1].to_owned(), site))
}

/// `DATA PERIODS,n,records an hour,…`: only whole hours are read.
fn check_periods(line: &str) -> Result<(), MalformedWeather> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    match fields.as_slice() {
        [name, _, records, ..] if name.eq_ignore_ascii_case("DATA PERIODS") && *records != "1" => Err(at(
            HEADER,
            format!(
                "the file has {records:?} records an hour (hours are read that are one line each); give a file of hours"
            ),
        )),
        _ => Ok(()),
    }
}

/// The last field of `DATA PERIODS,1,…`, a month and a day.
fn last_day(line: &str) -> Option<[u32; 2]> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    let (month, day) = fields.get(6).filter(|_| fields[1] == "1")?.split_once('/')?;
    Some([month.trim().parse().ok()?, day.trim().parse().ok()?])
}

/// The fields of an hour.
struct HourFields<'a> {
    line: usize,
    fields: Vec<&'a str>,
}

impl<'a> HourFields<'a> {
    fn split(line: usize, row: &'a str) -> Result<Self, MalformedWeather> {
        let fields: Vec<&str> = row.split(',').map(str::trim).collect();
        if fields.len() < FIELDS {
            let problem = format!(
                "the line has {} fields of 35 (sun and sky stand in 15 and 16); correct it",
                fields.len()
            );
            return Err(at(line, problem));
        }
        Ok(HourFields { line, fields })
    }

    fn number(&self, place: usize, what: &str) -> Result<f64, MalformedWeather> {
        let value = f64::from_str(self.fields[place]).ok().filter(|value| value.is_finite());
        value.ok_or_else(|| {
            let problem = format!(
                "{:?} stands for the {what} (field {}), which is a number; correct it",
                self.fields[place],
                place + 1
            );
            at(self.line, problem)
        })
    }

    fn whole(&self, place: usize, what: &str, [least, most]: [i32; 2]) -> Result<i32, MalformedWeather> {
        let value = self.number(place, what)?;
        if value.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&value) {
            return Ok(value as i32);
        }
        let problem = format!(
            "the {what} is {value} (field {}), where {least} to {most} are possible; correct it",
            place + 1
        );
        Err(at(self.line, problem))
    }

    fn radiation(&self, place: usize, what: &str) -> Result<f64, MalformedWeather> {
        let (value, field) = (self.number(place, what)?, place + 1);
        let problem = match value {
            MISSING.. => format!(
                "the {what} is missing ({value} in field {field}); fill the gap, or choose another file"
            ),
            0.0.. => return Ok(value),
            _ => format!("the {what} is {value} (field {field}), and light is not negative; correct it"),
        };
        Err(at(self.line, problem))
    }
}

fn hour(line: usize, row: &str, site: &Site) -> Result<WeatherHour, MalformedWeather> {
    let fields = HourFields::split(line, row)?;
    let year = fields.whole(0, "year", [-500, 6000])?;
    let [month, day] = [fields.whole(1, "month", [1, 12])?, fields.whole(2, "day", [1, 31])?];
    let end = fields.whole(3, "hour", [1, 24])?;
    let dew_point = fields.number(7, "dew point")?;
    let direct = fields.radiation(14, "direct normal radiation")?;
    let diffuse = fields.radiation(15, "diffuse horizontal radiation")?;
    let sun = SunPosition::at(site, [year, month, day], f64::from(end) - 0.5)
        .ok_or_else(|| at(line, format!("there is no day {day} in month {month} of {year}; correct it")))?;
    let conditions = Conditions {
        altitude: sun.altitude,
        azimuth: sun.azimuth,
        direct,
        diffuse,
        dew_point: if dew_point >= 99.0 { DEW_POINT } else { dew_point },
        day: day_of_year(month, day),
    };
    Ok(WeatherHour { month: month as u32, day: day as u32, hour: end as u32, conditions })
}

/// The day of a year of 365 days, from 1.
fn day_of_year(month: i32, day: i32) -> u32 {
    // Days before each month.
    const BEFORE: [i32; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];
    (BEFORE[month as usize - 1] + day) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(rows: &[&str]) -> String {
        let header = "LOCATION,Nowhere,-,UNK,made,0,51.5,-0.1,0.0,30.0\nDESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0\nHOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,\nCOMMENTS 2,\nDATA PERIODS,1,1,Data,Sunday, 1/ 1,12/31\n";
        format!("{header}{}\r\n", rows.join("\r\n"))
    }

    const NOON: &str = "2001,6,21,12,60,?9,20.0,12.0,60,101000,1200,1330,300,800,700.5,150,0,0,0,0,0,0,0,0";

    #[test]
    fn hours_are_read_with_the_sun_at_their_middle() {
        let weather = Weather::read(file(&[NOON, NOON]).as_bytes()).unwrap();
        assert_eq!((&weather.city[..], weather.hours.len()), ("Nowhere", 2));
        let WeatherHour { month, day, hour, conditions } = weather.hours[0];
        assert_eq!((month, day, hour, conditions.day), (6, 21, 12, 172));
        assert_eq!((conditions.direct, conditions.diffuse, conditions.dew_point), (700.5, 150.0, 12.0));
        // Half past eleven at Greenwich, about midsummer: 90° − 51.5° + 23.44° at noon, and a little less then.
        assert!((61.0..61.95).contains(&conditions.altitude) && conditions.azimuth < 180.0, "{conditions:?}");
    }

    /// At half past eleven of a zone twelve hours ahead Greenwich has night, and the file has sun.
    #[test]
    fn a_sun_that_shines_at_night_is_told() {
        let weather = |zone: &str| {
            Weather::read(file(&[NOON]).replace(",0.0,30.0", &format!(",{zone},30.0")).as_bytes()).unwrap()
        };
        assert_eq!(
            ["0.0", "2.0", "12.0"].map(|zone| weather(zone).hours_of_hidden_sun()),
            [None, None, Some(1)]
        );
    }

    #[test]
    fn malformed_lines_are_named_with_the_reason() {
        let refused = |text: &str| {
            let MalformedWeather { line, problem } = Weather::read(text.as_bytes()).unwrap_err();
            (line, problem)
        };
        let broken = |from: &str, to: &str| refused(&file(&[NOON, &NOON.replace(from, to)]));
        for (from, to, said) in [
            ("700.5", "9999", "direct normal radiation is missing"),
            ("700.5", "-1", "not negative"),
            ("700.5", "much", "\"much\" stands for the direct normal radiation (field 15)"),
            (",6,21", ",13,21", "month is 13"),
            (",6,21", ",6,31", "no day 31 in month 6"),
            (",12,60", ",25,60", "hour is 25"),
            (",300,800,700.5,150,0,0,0,0,0,0,0,0", "", "12 fields of 35"),
        ] {
            let (line, problem) = broken(from, to);
            assert!(line == 10 && problem.contains(said), "{line}: {problem}");
        }
        assert!(refused("x").1.contains("LOCATION") && refused("").0 == 1);
        assert!(refused(&file(&[]).replace("51.5", "151.5")).1.contains("latitude"));
        assert!(refused(&file(&[])).1.contains("ends before the first hour"));
        let (line, problem) = refused(&file(&[NOON]).replace("DATA PERIODS,1,1", "DATA PERIODS,1,4"));
        assert!(line == 8 && problem.contains("\"4\" records an hour"));
    }
}
