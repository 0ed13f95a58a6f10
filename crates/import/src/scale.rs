//! The likely length of a file's unit, from the sizes of what is in it.

use glam::DVec3;

/// Units that files are written in, and their lengths [m].
const UNITS: [(&str, f64); 5] =
    [("1 mm", 0.001), ("1 cm", 0.01), ("1 inch", 0.0254), ("1 foot", 0.3048), ("1 m", 1.0)];

/// The usual heights of things by words of their names [m].
const HEIGHTS: [(&str, f64); 8] = [
    ("door", 2.05),
    ("chair", 0.9),
    ("stool", 0.6),
    ("table", 0.75),
    ("desk", 0.75),
    ("sofa", 0.8),
    ("couch", 0.8),
    ("nightstand", 0.6),
];

/// The usual height of a room [m].
const ROOM: f64 = 2.8;

/// Meshes are seldom larger [m]: a scene of more than that was hardly meant in metres, unless it is as high as buildings are.
const LARGE: f64 = 120.0;
const BUILDING: [f64; 2] = [2.0, 60.0];

/// Rooms and houses are seldom narrower, or lower [m].
const NARROW: f64 = 1.5;
const LOW: f64 = 1.9;

/// A thing of which a file is a drawing is seldom larger [m]: STL holds parts of machines in millimetres.
const LARGE_PART: f64 = 12.0;

/// The factor by which things differ from their usual height without any doubt about the unit.
const USUAL: f64 = 2.2;

/// What is flatter than this part of its width is a plate of a thing.
const PLATE: f64 = 0.1;

/// The beginnings of the words by which the head of a file says its unit, and the unit's place in [`UNITS`].
const WORDS: [(&str, usize); 8] =
    [("milli", 0), ("mm", 0), ("centi", 1), ("cm", 1), ("inch", 2), ("feet", 3), ("foot", 3), ("met", 4)];

/// The part of a file in which a unit is looked for [bytes].
const HEAD: usize = 1024;

/// The unit that the comments at the head of a file say, as in SketchUp's `# File units = inches`.
pub(crate) fn said_unit(content: &[u8]) -> Option<(&'static str, f64)> {
    let head = String::from_utf8_lossy(&content[..content.len().min(HEAD)]).to_lowercase();
    let is_comment = |line: &&str| ["#", "comment", "solid"].iter().any(|is| line.starts_with(is));
    head.lines().filter(is_comment).find_map(|line| {
        let (before, unit) = line.split_once(['=', ':'])?;
        let is_unit = before.trim_end().ends_with("unit") || before.trim_end().ends_with("units");
        let unit = unit.trim_start();
        let place = || WORDS.iter().find(|(word, _)| unit.starts_with(word)).map(|&(_, place)| place);
        is_unit.then(place).flatten().map(|place| UNITS[place])
    })
}

/// A part of a mesh: its name and its extent [units of the file].
pub(crate) struct MeshPart<'a> {
    pub(crate) name: &'a str,
    pub(crate) extent: DVec3,
}

/// What the unit of a file is likely to be, in words and in metres; `None` where a metre is as likely as any. `extent` is that of the
/// whole, z up; `drawing` says whether the format is one of parts of machines.
pub(crate) fn likely_unit(
    extent: DVec3,
    parts: &[MeshPart<'_>],
    drawing: bool,
) -> Option<(&'static str, f64)> {
    let largest = extent.max_element();
    if !(largest.is_finite() && largest > 0.0) {
        return None;
    }
    let known = |part: &MeshPart<'_>| {
        let (_, usual) = HEIGHTS.iter().find(|(word, _)| names(part.name, word))?;
        // The top of a table is not as high as a table.
        let is_plate = part.extent.z < PLATE * part.extent.max_element();
        Some(usual / part.extent.z).filter(|ratio| ratio.is_finite() && !is_plate)
    };
    let mut ratios: Vec<f64> = parts.iter().filter_map(known).collect();
    ratios.sort_by(f64::total_cmp);
    if let Some(&ratio) = ratios.get(ratios.len() / 2) {
        // Handles of doors and legs of tables bear their names, too: only several things, or a wide difference, tell.
        let found = nearest(ratio);
        let is_clear = !(1.0 / USUAL..=USUAL).contains(&ratio) && (ratios.len() > 2 || ratio < 0.2);
        let fits = (0.3..LARGE).contains(&(largest * found.1));
        if found.1 < 1.0 && is_clear && fits {
            return Some(found);
        }
        if (1.0 / USUAL..=USUAL).contains(&ratio) {
            return None;
        }
    }
    // Rooms have a storey's height along some axis, and are no larger than houses.
    let is_house = largest < 40.0 && extent.to_array().iter().any(|&extent| (2.2..4.5).contains(&extent));
    if drawing && largest > LARGE_PART && !is_house {
        return Some(UNITS[0]);
    }
    if largest <= LARGE || (BUILDING[0]..BUILDING[1]).contains(&extent.z) {
        return None;
    }
    // Of the units that make a building of it, the one whose height is nearest to that of a room.
    let height = if extent.z > 0.02 * largest { extent.z } else { 0.3 * largest };
    let flat = extent.z <= 0.02 * largest;
    let holds_people = |&(_, length): &(&str, f64)| {
        let mut sizes = (extent * length).to_array();
        sizes.sort_by(f64::total_cmp);
        sizes[2] <= LARGE && sizes[1] >= NARROW && (flat || extent.z * length >= LOW)
    };
    let found = nearest_of(UNITS.into_iter().filter(holds_people), ROOM / height)?;
    (found.1 < 1.0).then_some(found)
}

/// Whether a name has a word, or its plural: a doorstep is no door, nor is what is outdoors one.
fn names(name: &str, word: &str) -> bool {
    let name = name.to_lowercase();
    name.match_indices(word).any(|(start, _)| {
        let (before, after) = (&name[..start], &name[start + word.len()..]);
        let after = after.strip_prefix('s').unwrap_or(after);
        let is_place = word == "door" && (before.ends_with("out") || before.ends_with("in"));
        !is_place && !after.starts_with(char::is_alphabetic)
    })
}

/// The unit whose length is nearest to a ratio, by factors.
fn nearest(ratio: f64) -> (&'static str, f64) {
    nearest_of(UNITS.into_iter(), ratio).expect("there are five")
}

/// The one of some units whose length is nearest to a ratio, by factors. Inches and feet are rare: they have to be much nearer than others.
fn nearest_of(units: impl Iterator<Item = (&'static str, f64)>, ratio: f64) -> Option<(&'static str, f64)> {
    let away = |&(name, length): &(&'static str, f64)| {
        let rare = match name {
            "1 inch" => 0.8,
            "1 foot" => 1.2,
            _ => 0.0,
        };
        (ratio / length).ln().abs() + rare
    };
    units.min_by(|a, b| away(a).total_cmp(&away(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn likely(extent: [f64; 3], parts: &[(&str, f64)], drawing: bool) -> Option<f64> {
        let extents = parts.iter().map(|&(name, height)| (name, DVec3::new(0.1, 0.1, height)));
        let parts: Vec<MeshPart<'_>> = extents.map(|(name, extent)| MeshPart { name, extent }).collect();
        likely_unit(DVec3::from_array(extent), &parts, drawing).map(|(_, length)| length)
    }

    #[test]
    fn units_are_guessed_from_rooms_and_their_things() {
        // Cornell's box of 556 units, offices in metres, centimetres and millimetres, a street.
        assert_eq!(likely([556.0, 559.0, 549.0], &[], false), Some(0.01));
        assert_eq!(likely([6.0, 4.0, 2.7], &[], false), None);
        assert_eq!(likely([600.0, 400.0, 270.0], &[], false), Some(0.01));
        assert_eq!(likely([6000.0, 4000.0, 2700.0], &[], false), Some(0.001));
        assert_eq!(likely([90.0, 40.0, 12.0], &[], false), None);
        // Plates that are called desks tell nothing of an office in millimetres.
        let plate = MeshPart { name: "desk0", extent: DVec3::new(1600.0, 800.0, 40.0) };
        let office = likely_unit(DVec3::new(8000.0, 8000.0, 2800.0), &[plate], false);
        assert_eq!(office, Some(("1 mm", 0.001)));
        // A campus, and a room of SketchUp's inches.
        assert_eq!(likely([350.0, 300.0, 19.0], &[], false), None);
        assert_eq!(likely([160.0, 190.0, 104.0], &[], false), Some(0.0254));
        // Doors tell: of a large hall in metres, and of a house in inches.
        assert_eq!(likely([300.0, 200.0, 20.0], &[("Door_1", 2.1)], false), None);
        assert_eq!(likely([90.0, 60.0, 50.0], &[("door", 45.0)], false), Some(0.0254));
        assert_eq!(
            likely([90.0, 60.0, 50.0], &[("Table", 74.0), ("chair", 88.0), ("chair2", 90.0)], false),
            Some(0.01)
        );
        // A court of three storeys and a house on its side, in centimetres; steps and frames of doors do not tell.
        assert_eq!(likely([2750.0, 1260.0, 1320.0], &[], false), Some(0.01));
        assert_eq!(
            likely(
                [1636.0, 1172.0, 337.0],
                &[("Doorstep-01", 2.0), ("Roof_Doorframe_0", 2.0), ("outdoor", 2.0)],
                false
            ),
            Some(0.01)
        );
        // Drawings of parts are in millimetres.
        assert_eq!(likely([80.0, 40.0, 20.0], &[], true), Some(0.001));
        assert_eq!(likely([5.0, 4.0, 3.0], &[], true), None);
        assert_eq!(likely([7.7, 17.3, 2.9], &[], true), None);
    }
}
