//! Why exchange factors cannot be counted, or say nothing of heat.

use std::path::PathBuf;

use thiserror::Error;

/// Why `radwalk factors` could not do what it was asked to.
#[derive(Debug, Error)]
pub enum FactorsFault {
    /// Reflections are those of one channel.
    #[error(
        "the scene is in colour, and factors with reflections are those of one reflectance a surface; choose --channel r, g or b, or leave out --reflections"
    )]
    NoChannel,
    /// Emissivities are those of one channel.
    #[error(
        "the scene is in colour, and View3D's file has one emissivity for each row; choose --channel r, g or b, or leave out --export view3d"
    )]
    NoEmissivities,
    /// Light that is weakened on its way.
    #[error(
        "the scene has panes, and exchange factors are those of rays that end where they land; remove each [[pane]], or run the job"
    )]
    Panes,
    /// Light that comes through surfaces.
    #[error(
        "a surface transmits light, and exchange factors are those of surfaces that reflect alone; remove `transmittance` from its material"
    )]
    Transmission,
    /// The table would be too large.
    #[error(
        "there are {groups} groups, more than {most} (every pair of them is a row of factors.csv); give --sparse, or choose coarser --groups: by-surface, by-material or a file"
    )]
    TooManyGroups {
        /// How many there are.
        groups: usize,
        /// How many there may be.
        most: usize,
    },
    /// Patches are groups of cells, and factors have groups of their own.
    #[error(
        "import.group_size makes patches of several faces, and factors are those of --groups of single faces; remove import.group_size"
    )]
    GroupedPatches,
    /// A group is called as a column is.
    #[error(
        "a group is called \"{name}\", as are walks that end on backs or leave the scene; rename the surface or material, or choose other --groups"
    )]
    Reserved {
        /// The name of the group.
        name: String,
    },
    /// There are no such groups.
    #[error(
        "--groups {typed}: there is no such file (and it is none of the words); choose by-patch, by-surface, by-material, or a file of [[group]] tables"
    )]
    NoGroups {
        /// The groups as the user typed them.
        typed: String,
    },
    /// A pair names what is no group.
    #[error(
        "--pairs {typed}: this is no pair of groups; write FROM:TO with two of {known}, TO also \"escape\" or \"back\""
    )]
    NoPair {
        /// The pair as the user typed it.
        typed: String,
        /// Some of the groups.
        known: String,
    },
    /// The budget is too small.
    #[error(
        "a budget of {paths} walks has none for each of the {groups} groups; give --paths {groups} or more, better 1000 times as many"
    )]
    FewWalks {
        /// The walks of the budget.
        paths: u64,
        /// How many groups there are.
        groups: usize,
    },
    /// An emissivity is asked of a part of a surface.
    #[error(
        "group \"{group}\" holds a part of surface {surface} only, and a surface has one emissivity; leave out `emissivity` there, or choose --groups by-surface"
    )]
    EmissivityOfPart {
        /// The name of the group.
        group: String,
        /// The name of the surface.
        surface: String,
    },
    /// Walks end on backs.
    #[error(
        "walks from group \"{group}\" end on backs of one-sided surfaces, which have no temperature; give these surfaces sides = 2, or close the scene"
    )]
    Backs {
        /// The name of the group.
        group: String,
    },
    /// Nothing determines a temperature.
    #[error(
        "the temperatures of some groups follow from nothing: as far as walks have met, they exchange heat with groups of given flux only; give one of them a temperature, or more walks, which may find a small window or a small group"
    )]
    Undetermined,
    /// Files of view factors are asked of Gebhart's factors.
    #[error(
        "the files of View3D, uDALES, EnergyPlus and OpenFOAM hold view factors, and these are Gebhart's, which count reflections already: the other program would count them twice; leave out --reflections and --temperatures, or choose --export mtx, npz or parquet"
    )]
    NoViewFactors,
    /// A flux is impossible.
    #[error(
        "the given fluxes would take group \"{group}\" below 0 K: it would have to give off more than it gets; give it another flux, or a temperature"
    )]
    BelowZero {
        /// The name of the group.
        group: String,
    },
    /// The counts are those of another question.
    #[error(
        "the counts in {} are those of other surfaces, groups, seed, kind of factors or, by rows, walks; use another --out, or --force in place of --resume", path.display()
    )]
    OtherCounts {
        /// The file of the counts.
        path: PathBuf,
    },
    /// The counts are those of several seeds.
    #[error(
        "the counts in {} are merged from several seeds, and no seed goes on from there; go on in one of the folders that were merged, and merge again",
        path.display()
    )]
    MergedCounts {
        /// The path of the file.
        path: PathBuf,
    },
    /// A part would be written over.
    #[error(
        "--out is among the folders of --join ({}: its rows would be replaced while they are read); choose another --out",
        part.display()
    )]
    JoinedIntoPart {
        /// The folder of the part.
        part: PathBuf,
    },
    /// A folder of --join has no rows.
    #[error("no rows were counted in {} (--join takes output folders of `radwalk factors --sparse`); name others, or count there", folder.display())]
    NoRows {
        /// The path of the folder.
        folder: PathBuf,
    },
    /// The scene cannot repeat at these steps.
    #[error(transparent)]
    Copies(radiosity::SceneError),
    /// Programs that read sparse factors are given these.
    #[error(
        "parquet, view3d, udales, udales-netcdf, energyplus and openfoam are files of sparse factors; give --sparse, too"
    )]
    SparseExports,
    /// Merged factors have no files to choose.
    #[error(
        "--export is for radiosities: merged factors are written as matrices where the first folder has these; leave it out"
    )]
    Exports,
    /// The counts cannot be merged.
    #[error("the counts in {} cannot be merged: {reason}", path.display())]
    Unmergeable {
        /// The path of the file.
        path: PathBuf,
        /// Why not, and what would help.
        reason: String,
    },
    /// The counts cannot be read.
    #[error("the counts in {} cannot be read ({reason}); use --force in place of --resume", path.display())]
    UnreadableCounts {
        /// The file of the counts.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}
