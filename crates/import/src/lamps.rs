//! Names that mean a lamp.

/// The beginnings of words that mean emission: `emit`, `emitter`, `emissive`, `emission`.
const EMISSION: &[&str] = &["emit", "emiss"];

/// Words that mean a lamp where they end a name; compounds such as `ceilinglight` end with them, too.
const LAMPS: &[&str] = &["light", "lights", "lamp", "lamps", "luminaire", "luminaires"];

/// Words that end with one of these and mean no lamp.
const NO_LAMPS: &[&str] =
    &["highlight", "highlights", "flashlight", "twilight", "daylight", "skylight", "clamp", "clamps"];

/// Words behind that of a lamp which leave it one, beside numbers.
const BESIDE: &[&str] = &[
    "bulb", "bulbs", "material", "mat", "mtl", "shader", "panel", "source", "surface", "tube", "sg", "obj",
    "mesh",
];

/// What things are made of: beside such a word `light` is a colour.
const MADE_OF: &[&str] = &[
    "wood", "wooden", "floor", "tile", "tiles", "brick", "bricks", "stone", "concrete", "marble", "oak",
    "pine", "walnut", "birch", "fabric", "cloth", "leather", "metal", "plastic", "paint", "carpet", "grey",
    "gray", "brown", "beige", "skin",
];

/// Whether a name means a lamp: `Ceiling_Light.001` and `lampBulb` do, `light_grey`, `LampShade` and `LightSwitch` do not.
pub(crate) fn names_a_lamp(name: &str) -> bool {
    let words = words(name);
    let is_lamp = |word: &str| {
        LAMPS.iter().any(|lamp| word.ends_with(lamp)) && !NO_LAMPS.iter().any(|other| word.ends_with(other))
    };
    let meant = words.iter().rev().find(|word| !BESIDE.contains(&word.as_str()));
    words.iter().any(|word| EMISSION.iter().any(|begin| word.starts_with(begin)))
        || (meant.is_some_and(|word| is_lamp(word))
            && !words.iter().any(|word| MADE_OF.contains(&word.as_str())))
}

/// The words of a name in small letters, without numbers: they part at other characters, and where a capital follows a small letter.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut small = false;
    for letter in name.chars() {
        if !letter.is_alphabetic() || (small && letter.is_uppercase()) {
            words.push(String::new());
        }
        if letter.is_alphabetic() {
            words.last_mut().expect("there is one").extend(letter.to_lowercase());
        }
        small = letter.is_lowercase();
    }
    words.retain(|word| !word.is_empty());
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_are_told_from_what_is_light_in_colour() {
        for name in [
            "light",
            "Light",
            "LIGHT",
            "Lamp.001",
            "Ceiling_Light",
            "ceilinglight2",
            "emitter",
            "EmissiveWhite",
            "lampBulb",
            "Area Light material",
            "luminaire-3",
            "BackLight",
            "area_light_01_mat",
            "Material_emission",
        ] {
            assert!(names_a_lamp(name), "{name}");
        }
        for name in [
            "light_grey",
            "Wood_Floor_Light",
            "LightWood",
            "light brown",
            "LampShade",
            "LampStand",
            "LightSwitch",
            "highlight",
            "clamp",
            "wall",
            "delighted",
            "lamp base",
            "Skylight",
            "remittance",
            "",
        ] {
            assert!(!names_a_lamp(name), "{name}");
        }
    }
}
