//! Notes on materials: a line for each kind of loss, with how many materials and how much area it is about, and what to type.

use radiosity::Spectrum;

use crate::in_words;
use crate::mesh::{LostProperty, Mesh};
use crate::scene::Finish;

/// The part of the area from which black materials are reported.
const WORTH_A_WORD: f64 = 0.01;

/// An argument that sets a key of a material by its name, quoted for a shell: `--set 'import.material."Red.003".emittance=10'`.
pub fn setting(material: &str, key: &str, value: &str) -> String {
    let quoted: String = material
        .chars()
        .flat_map(|letter| match letter {
            '"' | '\\' => vec!['\\', letter],
            '\'' => "'\\''".chars().collect(),
            letter => vec![letter],
        })
        .collect();
    format!("--set 'import.material.\"{quoted}\".{key}={value}'")
}

/// An area as notes tell it [m²].
pub(crate) fn area_in_words(area: f64) -> String {
    let digits = if (0.0..9.95).contains(&area) { 2 } else { 0 };
    if area > 0.0 && area < 0.01 { format!("{area:.1e} m²") } else { format!("{area:.digits$} m²") }
}

/// Some materials of a mesh, with their areas.
pub(crate) struct Few<'a> {
    count: usize,
    area: f64,
    /// The name of the one with the largest area.
    pub(crate) largest: &'a str,
}

impl<'a> Few<'a> {
    /// The used materials that `is_meant` chooses; `None` where there are none.
    pub(crate) fn of(mesh: &'a Mesh, areas: &[f64], is_meant: impl Fn(usize) -> bool) -> Option<Self> {
        let meant: Vec<usize> = (0..areas.len()).filter(|&i| areas[i] > 0.0 && is_meant(i)).collect();
        let largest = meant.iter().copied().max_by(|&a, &b| areas[a].total_cmp(&areas[b]))?;
        Some(Few {
            count: meant.len(),
            area: meant.iter().map(|&i| areas[i]).sum(),
            largest: &mesh.materials[largest].name,
        })
    }

    /// `material "Glass" (1.20 m²)`, or `4 materials (12 m²; "Glass" is the largest)`.
    pub(crate) fn in_words(&self) -> String {
        let area = area_in_words(self.area);
        match self.count {
            1 => format!("material {:?} ({area})", self.largest),
            count => format!("{count} materials ({area}; {:?} is the largest)", self.largest),
        }
    }
}

/// Adds which materials light passes, so that their faces are left out.
pub(crate) fn note_clear(mesh: &Mesh, finishes: &[Finish], areas: &[f64], notes: &mut Vec<String>) {
    let is_clear = |i: usize| finishes[i].is_left_out() && finishes[i].leave_out.is_none();
    if let Some(few) = Few::of(mesh, areas, is_clear) {
        notes.push(format!(
            "clear, so that light passes as if nothing were there: {}; {} makes it a surface",
            few.in_words(),
            setting(few.largest, "leave_out", "false")
        ));
    }
}

/// Adds what is left out of materials, and what is black, a line for each kind.
pub(crate) fn note_losses(mesh: &Mesh, finishes: &[Finish], areas: &[f64], notes: &mut Vec<String>) {
    let mut note = |what: &str, few: Option<Few<'_>>, remedy: &dyn Fn(&str) -> String| {
        if let Some(few) = few {
            notes.push(format!("{what}: {}{}", few.in_words(), remedy(few.largest)));
        }
    };
    let reflect =
        |value: &'static str| move |name: &str| format!("; {}", setting(name, "reflectance", value));
    let emit = |name: &str| format!("; {}", setting(name, "emittance", "100"));
    let pane = |name: &str| format!("; {}", setting(name, "leave_out", "true"));
    let as_given = |i: usize| finishes[i].own_reflectance;
    let loses = |i: usize, what: LostProperty| mesh.materials[i].lost.contains(&what);
    let undefined = Few::of(mesh, areas, |i| as_given(i) && loses(i, LostProperty::Definition));
    note("defined by no file, so reflectance 0.5 is assumed", undefined, &reflect("0.7"));
    let textured =
        |i: usize| as_given(i) && mesh.materials[i].texture.is_some() && !loses(i, LostProperty::Texture);
    note("textures, for which their mean colours stand", Few::of(mesh, areas, textured), &reflect("0.5"));
    let unread = Few::of(mesh, areas, |i| as_given(i) && loses(i, LostProperty::Texture));
    note("textures that are missing or of no known format, so colours stand alone", unread, &reflect("0.5"));
    let panes = Few::of(mesh, areas, |i| {
        [LostProperty::Transparency, LostProperty::Clearness].iter().any(|&what| loses(i, what))
    });
    note("transparent, and modelled as solid", panes, &pane);
    let mirrors = Few::of(mesh, areas, |i| as_given(i) && loses(i, LostProperty::Mirror));
    note("mirror-like in part, of which the diffuse part is modelled", mirrors, &reflect("0.8"));
    let varied =
        Few::of(mesh, areas, |i| finishes[i].own_emittance && loses(i, LostProperty::EmissionTexture));
    note("emission that varies, of which the mean is taken", varied, &emit);
    let saturated = Few::of(mesh, areas, |i| as_given(i) && loses(i, LostProperty::Saturation));
    note("colours that no red, green and blue make: the nearest are taken", saturated, &reflect("0.5"));
    let unlit = Few::of(mesh, areas, |i| as_given(i) && loses(i, LostProperty::Unlit));
    note("unlit by the file, of which the colour is taken as that of paint", unlit, &reflect("0.5"));
    let is_black = |i: usize| {
        let Finish { reflectance, emittance, .. } = finishes[i];
        !reflectance.is_lit() && !emittance.is_lit()
    };
    let total: f64 = areas.iter().sum();
    if let Some(black) = Few::of(mesh, areas, is_black).filter(|black| black.area >= WORTH_A_WORD * total) {
        let what =
            format!("black, {:.0} % of the area, and takes all light that comes", 100.0 * black.area / total);
        note(&what, Some(black), &reflect("0.5"));
    }
}

/// The materials whose reflectance is beyond a limit, in words, with the largest one.
pub(crate) fn beyond(
    mesh: &Mesh,
    finishes: &[Finish],
    areas: &[f64],
    is_beyond: impl Fn(Spectrum) -> bool,
) -> Option<String> {
    let few = Few::of(mesh, areas, |i| is_beyond(finishes[i].reflectance))?;
    let largest = mesh
        .materials
        .iter()
        .zip(finishes)
        .find(|(material, finish)| material.name == few.largest && is_beyond(finish.reflectance));
    let reflectance = largest.map_or_else(String::new, |(_, finish)| in_words(finish.reflectance));
    Some(format!("reflectances such as {reflectance}: {}", few.in_words()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_quoted_for_toml_and_for_shells() {
        assert_eq!(setting("Red.003", "emittance", "10"), "--set 'import.material.\"Red.003\".emittance=10'");
        assert_eq!(setting("a\"b'c", "power", "1"), "--set 'import.material.\"a\\\"b'\\''c\".power=1'");
    }

    #[test]
    fn areas_are_written_with_two_digits_or_none() {
        assert_eq!([0.004, 0.5, 9.0, 12.3].map(area_in_words), ["4.0e-3 m²", "0.50 m²", "9.00 m²", "12 m²"]);
    }
}
