//! VTK's XML files, which ParaView and PyVista read: particles as PolyData (`.vtp`), numbers on a regular grid as image data
//! (`.vti`). Numbers are raw bytes after the XML.

use super::Frame;
use std::fmt::Write as _;
use std::io::{self, Write};

/// Numbers at the points of a regular grid with edges along the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// The first point.
    pub origin: [f64; 3],
    pub spacing: [f64; 3],
    pub size: [usize; 3],
    /// Names, and values at the points, x running fastest.
    pub fields: Vec<(String, Vec<f32>)>,
}

/// The XML of a file, and the bytes that it refers to.
#[derive(Default)]
struct Document {
    xml: String,
    data: Vec<u8>,
}

impl Document {
    fn line(&mut self, line: impl AsRef<str>) {
        self.xml += line.as_ref();
        self.xml.push('\n');
    }

    /// Adds an array of numbers of a type, with some in each row.
    fn array<const B: usize>(
        &mut self,
        kind: &str,
        name: &str,
        columns: usize,
        numbers: impl Iterator<Item = [u8; B]>,
    ) {
        let offset = self.data.len();
        self.data.extend([0; 8]);
        self.data.extend(numbers.flatten());
        let length = self.data.len() - offset - 8;
        self.data[offset..offset + 8].copy_from_slice(&(length as u64).to_le_bytes());
        self.line(format!(
            "<DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{columns}\" NumberOfTuples=\"{}\" format=\"appended\" \
             offset=\"{offset}\"/>",
            escaped(name),
            length / (B * columns)
        ));
    }

    fn vectors(&mut self, name: &str, vectors: &[[f64; 3]]) {
        self.array("Float64", name, 3, vectors.iter().flatten().map(|x| x.to_le_bytes()));
    }

    /// Opens a data set, with the time of a frame, which ParaView shows, its step, and the names of species.
    fn open(&mut self, kind: &str, attributes: &str, frame: &Frame) {
        self.line("<?xml version=\"1.0\"?>");
        self.line(format!(
            "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<{kind}{attributes}>\n<FieldData>"
        ));
        self.array("Float64", "TimeValue", 1, [frame.time.to_le_bytes()].into_iter());
        self.array("Int64", "Step", 1, [(frame.step as i64).to_le_bytes()].into_iter());
        // Texts are the numbers of their bytes, each ended by 0.
        let mut text = String::new();
        for byte in frame.names.iter().flat_map(|name| name.bytes().chain([0])) {
            let _ = write!(text, "{byte} ");
        }
        let names = frame.names.len();
        self.line(format!(
            "<Array type=\"String\" Name=\"SpeciesNames\" NumberOfTuples=\"{names}\" format=\"ascii\">{text}</Array>\n</FieldData>"
        ));
    }

    fn write(mut self, kind: &str, to: &mut impl Write) -> io::Result<()> {
        self.line(format!("</Piece>\n</{kind}>\n<AppendedData encoding=\"raw\">"));
        to.write_all(self.xml.as_bytes())?;
        to.write_all(b"_")?;
        to.write_all(&self.data)?;
        to.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}

fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Writes the particles as PolyData: a vertex for each, with `species` counted from 0, `id`, and `velocity` if it is known.
pub fn write_vtp(frame: &Frame, to: &mut impl Write) -> io::Result<()> {
    let count = frame.len();
    let mut file = Document::default();
    file.open("PolyData", "", frame);
    file.line(format!(
        "<Piece NumberOfPoints=\"{count}\" NumberOfVerts=\"{count}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n\
         <PointData Scalars=\"species\">"
    ));
    file.array("Int32", "species", 1, frame.species.iter().map(|s| s.to_le_bytes()));
    file.array("Int32", "id", 1, frame.tag.iter().map(|t| t.to_le_bytes()));
    if let Some(v) = frame.v {
        file.vectors("velocity", v);
    }
    file.line("</PointData>\n<Points>");
    file.vectors("Points", frame.x);
    file.line("</Points>\n<Verts>");
    file.array("Int64", "connectivity", 1, (0..count as i64).map(i64::to_le_bytes));
    file.array("Int64", "offsets", 1, (1..=count as i64).map(i64::to_le_bytes));
    file.line("</Verts>");
    file.write("PolyData", to)
}

/// Writes a grid as image data, with the time, step and species of a frame.
pub fn write_vti(grid: &Grid, frame: &Frame, to: &mut impl Write) -> io::Result<()> {
    let [origin, spacing] = [grid.origin, grid.spacing].map(|p| p.map(|x| format!("{x:?}")).join(" "));
    let extent = grid.size.map(|n| format!("0 {}", n.saturating_sub(1))).join(" ");
    let mut file = Document::default();
    file.open(
        "ImageData",
        &format!(" WholeExtent=\"{extent}\" Origin=\"{origin}\" Spacing=\"{spacing}\""),
        frame,
    );
    file.line(format!("<Piece Extent=\"{extent}\">\n<PointData>"));
    for (name, values) in &grid.fields {
        file.array("Float32", name, 1, values.iter().map(|x| x.to_le_bytes()));
    }
    file.line("</PointData>");
    file.write("ImageData", to)
}
