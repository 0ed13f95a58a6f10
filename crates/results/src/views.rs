//! The pictures of views with names. What names a summary gives is what may be removed: others may be a person's own.

use std::fs;

use job::OutputFile;
use report::OutputFolder;
use serde::Deserialize;

#[derive(Default, Deserialize)]
struct Named {
    #[serde(default)]
    views: Vec<ViewName>,
}

#[derive(Deserialize)]
struct ViewName {
    name: String,
}

/// The file of the picture of a view with a name.
pub(crate) fn picture_of(view: &str, kind: &str) -> String {
    format!("radiosity-{view}.{kind}")
}

/// The pictures of the views that the summary in a folder names.
pub(crate) fn pictures_in(folder: &OutputFolder) -> Vec<String> {
    let summary = fs::read(folder.file(OutputFile::Summary.name())).unwrap_or_default();
    let named: Named = serde_json::from_slice(&summary).unwrap_or_default();
    named.views.iter().flat_map(|view| ["png", "exr"].map(|kind| picture_of(&view.name, kind))).collect()
}
