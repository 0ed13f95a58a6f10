//! What is done to a scene once all of it is read: flipped surfaces are turned, faces are grouped.

use import::GroupLimits;
use radiosity::SceneSpec;

use super::SceneFile;
use crate::error::Error;

impl SceneFile {
    /// Turns what is flipped, if `repair` says so, and groups the faces of meshes where there is a `grouping`.
    pub(crate) fn prepare(&mut self, repair: bool, grouping: Option<&GroupLimits>) -> Result<(), Error> {
        if repair {
            self.turn_flipped()?;
        }
        grouping.into_iter().for_each(|grouping| self.group(grouping));
        Ok(())
    }

    /// Makes patches of neighbouring faces of one object and one material of a mesh.
    fn group(&mut self, grouping: &GroupLimits) {
        let kinds = self.kinds();
        let spec = std::mem::replace(&mut self.spec, SceneSpec::new(Vec::new()));
        let labels = import::groups(&spec, |surface| kinds[surface], grouping);
        self.spec = spec.grouped(&labels);
        let (patches, cells) = (self.spec.patch_count(), self.spec.cell_count());
        self.notes.push(format!("import.group_size: {cells} faces are grouped in {patches} patches"));
    }
}
