//! The keys of scene files.

use serde_json::{Value, json};

use crate::key::{Key, names};
use crate::schema::parts::*;
use crate::vocabulary::AUTO;

/// The keys of a scene file.
pub(crate) const SCENE: [Key; 9] = [
    Key::new(
        "material",
        || json!({"type": "object", "additionalProperties": table(&MATERIAL)}),
        "Materials by name.",
    ),
    Key::new("surface", || list_of(table(&SURFACE), 0), "Flat surfaces, in the order of their patches."),
    Key::new("mesh", || list_of(table(&MESH), 0), "Meshes, whose surfaces follow all others."),
    Key::new("sensor", || list_of(table(&SENSOR), 0), "Places where light is measured that block none."),
    Key::new(
        "sky",
        || table(&SKY),
        "A uniform environment: six black surfaces around the scene, behind all others.",
    ),
    Key::new(
        "lamp",
        || list_of(table(&LAMP), 0),
        "Lamps without area. They make the unit of light the lumen.",
    ),
    Key::new(
        "plane",
        || list_of(table(&PLANE), 0),
        "Grids of points at which light is measured: work planes.",
    ),
    Key::new("points", || list_of(table(&POINTS), 0), "Points, from files, at which light is measured."),
    Key::new("pane", || list_of(table(&PANE), 0), "Panes of clear glass, which light crosses."),
];

pub(crate) const SCENE_KEYS: &[&str] = &names(&SCENE);

/// The keys of `[sky]`.
pub(crate) const SKY: [Key; 1] = [Key::new(
    "emittance",
    light,
    "What a horizontal plane receives from all of the sky [W/m²]; a number, or [red, green, blue].",
)
.required()];

pub(crate) const SKY_KEYS: &[&str] = &names(&SKY);

/// The keys of `[material.NAME]`.
pub(crate) const MATERIAL: [Key; 3] = [
    Key::new("reflectance", reflectance, "In [0, 1); a number, or [red, green, blue]. Default: 0."),
    Key::new("emittance", light, "Emitted power per area; a number, or [red, green, blue]. Default: 0."),
    Key::new(
        "transmittance",
        reflectance,
        "The part of the light that leaves the other side, diffusely, below 1 with the reflectance; for surfaces with sides = 2, in `radwalk daylight`. Default: 0.",
    ),
];

pub(crate) const MATERIAL_KEYS: &[&str] = &names(&MATERIAL);

/// The keys of a `[[surface]]`.
pub(crate) const SURFACE: [Key; 7] = [
    Key::new("name", text, "Shown in the rows of its patches. Default: its number."),
    Key::new("material", text, "The name of a material.").required(),
    Key::new("quad", corners, "A parallelogram: corner c, c + u, c + v; the front faces u × v."),
    Key::new(
        "triangle",
        corners,
        "A triangle: a, b, c; the front by the right-hand rule. A surface has either a quad or a triangle.",
    ),
    Key::new(
        "patches",
        || json!({"anyOf": [exactly(cells(), 2), integer(1, u16::MAX.into()), {"enum": [AUTO]}]}),
        "Cells along u and v of a quad; k for the k² cells of a triangle; \"auto\" for cells that a pilot chooses. Default: one patch.",
    ),
    Key::new(
        "sides",
        || json!({"enum": [1, 2]}),
        "1: the front reflects and emits; 2: both sides. Default: 1.",
    ),
    Key::new("emit", || list_of(table(&EMIT), 0), "Emittances of single cells, in place of the material's."),
];

pub(crate) const SURFACE_KEYS: &[&str] = &names(&SURFACE);

/// The keys of a `[[sensor]]`.
pub(crate) const SENSOR: [Key; 5] = [
    Key::new("name", text, "Shown in the rows of its patches. Default: its number."),
    Key::new("quad", corners, "A parallelogram: corner c, c + u, c + v; it faces u × v."),
    Key::new(
        "patches",
        || exactly(integer(1, u32::MAX.into()), 2),
        "Cells of the quad along u and v. Default: one.",
    ),
    Key::new("point", point, "A point, in place of a quad [m]."),
    Key::new("normal", point, "The direction that the point faces, of any length."),
];

pub(crate) const SENSOR_KEYS: &[&str] = &names(&SENSOR);

/// The keys of a `[[lamp]]`.
pub(crate) const LAMP: [Key; 10] = [
    Key::new("name", text, "Sources tell lamps by it. Default: its number."),
    Key::new("file", text, "A luminaire, .ies or .ldt, relative to this file."),
    Key::new(
        "intensity",
        light,
        "In place of a file: the same in every direction [cd]; a number, or [red, green, blue].",
    ),
    Key::new(
        "cone",
        || exactly(number(), 2),
        "With `intensity`: a spot, full up to the first angle from its aim, dark from the second on [°].",
    ),
    Key::new(
        "illuminance",
        light,
        "In place of a file: light from far away, on a plane across it [lx]; a number, or [red, green, blue].",
    ),
    Key::new(
        "diameter",
        positive,
        "With `illuminance`: the angle that the lamp takes up [°]. Default: parallel light.",
    ),
    Key::new("position", point, "The centre of its luminous opening [m]."),
    Key::new("aim", point, "The direction of γ = 0, of any length. Default: down."),
    Key::new(
        "rotation",
        number,
        "Turn about its aim [°]: of a lamp that is aimed down, counter-clockwise as seen from above. Default: 0.",
    ),
    Key::new("factor", light, "Multiplies its light: maintenance, dimming, colour. Default: 1."),
];

pub(crate) const LAMP_KEYS: &[&str] = &names(&LAMP);

/// The keys of a `[[plane]]`.
pub(crate) const PLANE: [Key; 9] = [
    Key::new("name", text, "Its figures are shown by it. Default: `plane` and its number."),
    Key::new("origin", point, "A corner of the plane [m].").required(),
    Key::new("u", point, "A side of the plane, from its corner [m].").required(),
    Key::new("v", point, "A side of the plane, from its corner [m].").required(),
    Key::new(
        "spacing",
        positive,
        "About the distance of the points [m]: they are the middles of equal cells.",
    )
    .required(),
    Key::new("height", || json!({"type": "number"}), "Raises it upwards, across u and v [m]. Default: 0."),
    Key::new("normal", point, "The direction that the points face. Default: across u and v, upwards."),
    Key::new("measure", measures, MEASURED),
    Key::new("demand", || table(&DEMAND), DEMANDED),
];

fn measures() -> Value {
    json!({"enum": ["planar", "cylindrical", "semicylindrical", "ugr"]})
}

/// What `measure` is.
const MEASURED: &str = "Illuminance on the side that the points face, or on an upright cylinder, or on its half that they face; or UGR at eyes that look along `normal`. Default: planar.";

/// What `demand` is.
const DEMANDED: &str = "What its figures have to reach; the run says with what confidence they do.";

/// The keys of a `demand`.
pub(crate) const DEMAND: [Key; 5] = [
    Key::new("mean", positive, "The least mean [lx]."),
    Key::new("minimum", positive, "The least illuminance of a point [lx]."),
    Key::new("uniformity", ratio, "The least U₀, the minimum over the mean."),
    Key::new("diversity", ratio, "The least U_d, the minimum over the maximum."),
    Key::new("ugr", positive, "The largest UGR of an eye; of `measure = \"ugr\"` alone."),
];

pub(crate) const DEMAND_KEYS: &[&str] = &names(&DEMAND);

/// A number above 0, at most 1.
fn ratio() -> Value {
    json!({"type": "number", "exclusiveMinimum": 0, "maximum": 1})
}

pub(crate) const PLANE_KEYS: &[&str] = &names(&PLANE);

/// The keys of a `[[points]]`.
pub(crate) const POINTS: [Key; 4] = [
    Key::new("name", text, "Their figures are shown by it. Default: the name of the file."),
    Key::new("file", text, "A point a line, x y z dx dy dz, relative to this file.").required(),
    Key::new("measure", measures, MEASURED),
    Key::new("demand", || table(&DEMAND), DEMANDED),
];

pub(crate) const POINTS_KEYS: &[&str] = &names(&POINTS);

/// The keys of a `[[pane]]`.
pub(crate) const PANE: [Key; 3] = [
    Key::new("name", text, "Messages tell panes by it. Default: its number."),
    Key::new("quad", corners, "A parallelogram: corner c, c + u, c + v [m].").required(),
    Key::new(
        "transmittance",
        positive,
        "The part of the light that passes straight through, at most 0.918; less passes aslant, as through one plate of glass.",
    )
    .required(),
];

pub(crate) const PANE_KEYS: &[&str] = &names(&PANE);

/// The keys of an entry of `emit`.
pub(crate) const EMIT: [Key; 2] = [
    Key::new("cell", || exactly(count(0), 2), "Its number along u and v (triangle: row, position).")
        .required(),
    Key::new("emittance", light, "Emitted power per area.").required(),
];

pub(crate) const EMIT_KEYS: &[&str] = &names(&EMIT);

/// The keys of a `[[mesh]]`.
pub(crate) const MESH: [Key; 3] = [
    Key::new("file", text, "The mesh, relative to this file.").required(),
    Key::new("material", text, "The material of all its faces. Default: the file's own."),
    Key::new("max_patch_area", positive, "Triangles are cut until no patch is larger [m²]."),
];

pub(crate) const MESH_KEYS: &[&str] = &names(&MESH);

/// A number of cells along an edge.
fn cells() -> Value {
    integer(1, u32::MAX.into())
}

fn number() -> Value {
    json!({"type": "number"})
}
