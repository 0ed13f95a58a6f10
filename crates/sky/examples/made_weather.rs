//! Writes `configs/weather/made.epw`: two days of each month, a clear one and a dull one, at a place that is made up.
//!
//! ```sh
//! cargo run -p radwalk-sky --example made_weather > configs/weather/made.epw
//! ```

use sky::{Site, SunPosition};

const SITE: Site = Site { latitude: 48.0, longitude: 11.0, time_zone: 1.0, elevation: 500.0 };

fn main() {
    let Site { latitude, longitude, time_zone, elevation } = SITE;
    println!("LOCATION,Madeup,-,UNK,made_weather.rs,0,{latitude},{longitude},{time_zone},{elevation}");
    println!("DESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0");
    println!("HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0");
    println!("COMMENTS 1,Not measured: the sun and a rule\nCOMMENTS 2,Two days of each month");
    println!("DATA PERIODS,1,1,Data,Monday,1/10,12/20");
    for month in 1..=12 {
        for (day, clear) in [(10, true), (20, false)] {
            (1..=24).for_each(|hour| println!("{}", line([month, day], hour, clear)));
        }
    }
}

/// An hour: clear days have a beam that the air dims along its way and a little sky, dull ones have sky alone.
fn line([month, day]: [i32; 2], hour: i32, clear: bool) -> String {
    let sun =
        SunPosition::at(&SITE, [2001, month, day], f64::from(hour) - 0.5).expect("there is such an hour");
    let height = sun.direction()[2].max(0.0);
    let direct = if clear && height > 0.0 { 1100.0 * (-0.25 / height).exp() } else { 0.0 };
    let diffuse = if clear { 110.0 * height.sqrt() } else { 330.0 * height };
    let global = diffuse + direct * height;
    let cloud = if clear { 1 } else { 10 };
    format!(
        "2001,{month},{day},{hour},60,made,10.0,8.0,87,95000,0,0,300,{global:.0},{direct:.0},{diffuse:.0},0,0,0,0,180,2.0,{cloud},{cloud},9999,9999,9,999999999,15,0.1,0,88,0.2,0.0,1.0"
    )
}
