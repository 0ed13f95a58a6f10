//! The XML formats of VTK: `UnstructuredGrid` and `PolyData`, in pieces.

use std::path::Path;

use roxmltree::{Document, Node};

use super::cells::{CellMesh, add_cells, facet_rank, most_numbers};
use super::encoded::{Packing, VtkScalar, decode};
use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::Mesh;
use crate::text::{number, words};

/// Reads a file of one of the XML formats.
pub(super) fn read(path: &Path, content: &[u8]) -> Result<Mesh, Error> {
    let (head, appended) = split(content).map_err(|fault| fault.at(path, FileSpot::File))?;
    let document = Document::parse(&head)
        .map_err(|error| no_vtk(format!("not XML: {error}")).at(path, FileSpot::File))?;
    let root = document.root_element();
    let file = VtkXml::of(root, appended, content.len()).map_err(|fault| fault.at(path, FileSpot::File))?;
    let mut reader =
        XmlReader { path, document: &document, file, mesh: CellMesh::new(path), facets: Vec::new() };
    let pieces: Vec<Node<'_, '_>> = root.descendants().filter(|node| node.has_tag_name("Piece")).collect();
    let facets = facet_array(&pieces);
    for piece in pieces {
        reader.piece(piece, facets)?;
    }
    let XmlReader { mesh, facets: ids, .. } = reader;
    mesh.finish(&ids, facets.unwrap_or_default()).map_err(|fault| fault.at(path, FileSpot::File))
}

/// The XML as text without the appended data, and these.
fn split(content: &[u8]) -> Result<(String, Option<Appended<'_>>), UnplacedError> {
    const TAG: &[u8] = b"<AppendedData";
    let text = |bytes: &[u8]| match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => Err(no_vtk(format!("the text is not UTF-8: {error}"))),
    };
    let Some(begin) = content.windows(TAG.len()).position(|word| word == TAG) else {
        return Ok((text(content)?, None));
    };
    let rest = &content[begin..];
    let end = rest.iter().position(|&byte| byte == b'>').ok_or_else(UnplacedError::short)?;
    let start = rest[end..].iter().position(|&byte| byte == b'_').ok_or_else(UnplacedError::short)?;
    let base64 = rest[..end].windows(6).any(|word| word == b"base64");
    let head = text(&content[..begin])? + "</VTKFile>";
    Ok((head, Some(Appended { data: &rest[end + start + 1..], base64 })))
}

/// The data behind the XML, to which arrays have offsets.
#[derive(Clone, Copy)]
struct Appended<'a> {
    data: &'a [u8],
    base64: bool,
}

fn no_vtk(problem: String) -> UnplacedError {
    UnplacedError::new(problem, "no geometry can be read from it", "export the file again")
}

/// What the first element says of all arrays.
struct VtkXml<'a> {
    packing: Packing,
    /// The most numbers of an array.
    most: u64,
    appended: Option<Appended<'a>>,
    /// The offsets of all arrays, in ascending order.
    offsets: Vec<usize>,
}

impl<'a> VtkXml<'a> {
    fn of(root: Node<'_, '_>, appended: Option<Appended<'a>>, bytes: usize) -> Result<Self, UnplacedError> {
        let kind = root.attribute("type").unwrap_or_default();
        if !root.has_tag_name("VTKFile") || !matches!(kind, "UnstructuredGrid" | "PolyData") {
            let found = format!("{} {kind:?}", root.tag_name().name());
            return Err(UnplacedError::new(
                format!("the XML is {found}"),
                "VTKFile of the types UnstructuredGrid and PolyData are read",
                "extract the surface and write it as .vtu or .vtp",
            ));
        }
        let zlib = match root.attribute("compressor") {
            None => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                return Err(UnplacedError::new(
                    format!("its arrays are compressed by {other}"),
                    "zlib is read",
                    "write the file without compression, or by zlib",
                ));
            }
        };
        let header = root.attribute("header_type").unwrap_or("UInt32");
        let header = VtkScalar::of(header).ok_or_else(|| unknown_type(header))?;
        let big = root.attribute("byte_order") == Some("BigEndian");
        let mut offsets: Vec<usize> = root.descendants().filter_map(offset).collect();
        offsets.sort_unstable();
        let most = most_numbers(bytes);
        Ok(VtkXml { packing: Packing { big, header, zlib, most: 0 }, most, appended, offsets })
    }

    /// The numbers of an array, whatever its encoding.
    fn numbers(&self, array: Node<'_, '_>) -> Result<Vec<f64>, UnplacedError> {
        let name = array.attribute("type").unwrap_or_default();
        let scalar = VtkScalar::of(name).ok_or_else(|| unknown_type(name))?;
        // Each number becomes one of 8 bytes, however few the file has for it.
        let packing = Packing { most: self.most * scalar.size() as u64, ..self.packing };
        let text = || array.children().filter_map(|child| child.text()).collect::<String>();
        let bytes = match array.attribute("format").unwrap_or("ascii") {
            "ascii" => return words(text().as_bytes()).map(|word| number(Some(word))).collect(),
            "binary" => packing.unpack(&decode(&text())?)?,
            _ => self.appended(offset(array).ok_or_else(UnplacedError::short)?, packing)?,
        };
        Ok(scalar.numbers(&bytes, self.packing.big))
    }

    /// The bytes of an array in the appended data.
    fn appended(&self, offset: usize, packing: Packing) -> Result<Vec<u8>, UnplacedError> {
        let Appended { data, base64 } = self.appended.ok_or_else(UnplacedError::short)?;
        let next = self.offsets.iter().copied().find(|&other| other > offset).unwrap_or(data.len());
        let data = data.get(offset..next.min(data.len())).ok_or_else(UnplacedError::short)?;
        if !base64 {
            return packing.unpack(data);
        }
        // Behind the last array the XML goes on.
        let end = data.iter().position(|&byte| byte == b'<').unwrap_or(data.len());
        let text =
            std::str::from_utf8(&data[..end]).map_err(|error| no_vtk(format!("no base64: {error}")))?;
        packing.unpack(&decode(text)?)
    }
}

fn offset(array: Node<'_, '_>) -> Option<usize> {
    array.attribute("offset")?.trim().parse().ok()
}

fn unknown_type(name: &str) -> UnplacedError {
    UnplacedError::new(
        format!("unknown type {name:?}"),
        "VTK has Int8 to UInt64, Float32 and Float64",
        "export the file again",
    )
}

/// The name of the cell array of facet ids that every piece has.
fn facet_array<'a>(pieces: &[Node<'a, '_>]) -> Option<&'a str> {
    let names = |piece: &Node<'a, '_>| -> Vec<&'a str> {
        let data = piece.children().filter(|node| node.has_tag_name("CellData"));
        data.flat_map(|data| data.children().filter_map(|array| array.attribute("Name"))).collect()
    };
    let (first, others) = pieces.split_first()?;
    let in_all = |name: &&str| others.iter().all(|piece| names(piece).contains(name));
    let ranked = |name: &'a str| facet_rank(name).map(|rank| (rank, name));
    names(first).into_iter().filter(in_all).filter_map(ranked).min().map(|(_, name)| name)
}

struct XmlReader<'a, 'x> {
    path: &'a Path,
    document: &'a Document<'x>,
    file: VtkXml<'a>,
    mesh: CellMesh,
    /// The facet ids of the cells so far.
    facets: Vec<f64>,
}

impl XmlReader<'_, '_> {
    fn piece(&mut self, piece: Node<'_, '_>, facets: Option<&str>) -> Result<(), Error> {
        let first = self.mesh.points();
        let points = child(piece, "Points").and_then(|points| child(points, "DataArray"));
        if let Some(array) = points {
            let points = self.numbers(array)?;
            self.mesh.add_points(&points).map_err(|fault| self.fault(array, fault))?;
        }
        if let Some(cells) = child(piece, "Cells") {
            let types = self.named(cells, "types")?;
            self.cells(cells, first, |cell| types.get(cell).map(|&kind| kind as u64))?;
        }
        // Facet ids are in this order, whatever that of the lists.
        for (list, kind) in [("Verts", 1), ("Lines", 4), ("Polys", 7), ("Strips", 6)] {
            if let Some(cells) = child(piece, list) {
                self.cells(cells, first, |_| Some(kind))?;
            }
        }
        let Some(facets) = facets else { return Ok(()) };
        let array = child(piece, "CellData")
            .and_then(|data| data.children().find(|array| array.attribute("Name") == Some(facets)));
        if let Some(array) = array {
            let ids = self.numbers(array)?;
            self.facets.extend(ids);
        }
        Ok(())
    }

    fn cells(
        &mut self,
        cells: Node<'_, '_>,
        first: usize,
        kind: impl Fn(usize) -> Option<u64>,
    ) -> Result<(), Error> {
        let (connectivity, ends) = (self.named(cells, "connectivity")?, self.named(cells, "offsets")?);
        let added = add_cells(&mut self.mesh, (&connectivity, &ends), first, kind);
        added.map_err(|fault| self.fault(cells, fault))
    }

    /// The numbers of an array by its name; none where there is no such array.
    fn named(&self, parent: Node<'_, '_>, name: &str) -> Result<Vec<f64>, Error> {
        let array = parent.children().find(|array| array.attribute("Name") == Some(name));
        array.map_or(Ok(Vec::new()), |array| self.numbers(array))
    }

    fn numbers(&self, array: Node<'_, '_>) -> Result<Vec<f64>, Error> {
        self.file.numbers(array).map_err(|fault| self.fault(array, fault))
    }

    fn fault(&self, node: Node<'_, '_>, fault: UnplacedError) -> Error {
        fault.at(self.path, FileSpot::Line(self.document.text_pos_at(node.range().start).row as usize))
    }
}

fn child<'a, 'x>(parent: Node<'a, 'x>, name: &str) -> Option<Node<'a, 'x>> {
    parent.children().find(|node| node.has_tag_name(name))
}
