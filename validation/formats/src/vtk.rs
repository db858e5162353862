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

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::PeriodicBox;

    /// The XML, and the numbers of an array as VTK reads them: after the underscore and the length of the array.
    fn array<const B: usize>(file: &[u8], name: &str) -> Vec<[u8; B]> {
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let end = file.windows(mark.len()).position(|part| part == mark).unwrap();
        let xml = std::str::from_utf8(&file[..end]).unwrap();
        let line = xml.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap();
        let attribute = |key: &str| -> usize {
            line.split(&format!("{key}=\"")).nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        let data = &file[end + mark.len() + attribute("offset")..];
        let length = u64::from_le_bytes(data[..8].try_into().unwrap()) as usize;
        assert_eq!(length, B * attribute("NumberOfTuples") * attribute("NumberOfComponents"), "{name}");
        data[8..8 + length].as_chunks::<B>().0.to_vec()
    }

    fn written(write: impl Fn(&Frame, &mut Vec<u8>)) -> Vec<u8> {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0, 5.0, 6.0], [true; 3]).unwrap();
        let x = [[0.5, 1.0, 2.0], [3.0, 0.25, 5.5], [1.0, 2.0, 3.0]];
        let (species, tag, names) = ([0, 1, 1], [3, 1, 2], ["A".to_owned(), "B".to_owned()]);
        let frame = Frame {
            step: 7,
            time: 0.35,
            dimensions: 3,
            domain: &domain,
            names: &names,
            x: &x,
            v: None,
            species: &species,
            tag: &tag,
        };
        let mut file = Vec::new();
        write(&frame, &mut file);
        file
    }

    /// Every particle is a vertex of one point, whose numbers end where the next one's begin.
    #[test]
    fn particles_are_vertices() {
        let file = written(|frame, to| write_vtp(frame, to).unwrap());
        let of = |name: &str| array::<8>(&file, name).into_iter().map(i64::from_le_bytes).collect::<Vec<_>>();
        let (points, ends) = (of("connectivity"), of("offsets"));
        let mut begin = 0;
        let vertices: Vec<Vec<i64>> = ends
            .iter()
            .map(|end| points[std::mem::replace(&mut begin, *end) as usize..*end as usize].to_vec())
            .collect();
        assert_eq!(vertices, [[0], [1], [2]]);
        let ids: Vec<i32> = array::<4>(&file, "id").into_iter().map(i32::from_le_bytes).collect();
        let species: Vec<i32> = array::<4>(&file, "species").into_iter().map(i32::from_le_bytes).collect();
        assert_eq!((ids, species), (vec![3, 1, 2], vec![0, 1, 1]));
        let x: Vec<f64> = array::<8>(&file, "Points").into_iter().map(f64::from_le_bytes).collect();
        assert_eq!(x[3..6], [3.0, 0.25, 5.5]);
        let time: Vec<f64> = array::<8>(&file, "TimeValue").into_iter().map(f64::from_le_bytes).collect();
        assert_eq!(time, [0.35]);
    }

    /// Extents name the first and the last point of each direction, so they have as many points as there are values.
    #[test]
    fn extents_have_as_many_points_as_values() {
        let values: Vec<f32> = (0..24u8).map(f32::from).collect();
        let grid = Grid {
            origin: [0.5, -1.0, 2.0],
            spacing: [1.0, 0.5, 0.25],
            size: [4, 3, 2],
            fields: vec![("density".to_owned(), values.clone())],
        };
        let file = written(|frame, to| write_vti(&grid, frame, to).unwrap());
        let xml = String::from_utf8_lossy(&file);
        for key in ["WholeExtent", " Extent"] {
            let extent = xml.split(&format!("{key}=\"")).nth(1).unwrap().split('"').next().unwrap();
            let ends: Vec<i64> = extent.split(' ').map(|end| end.parse().unwrap()).collect();
            let points: Vec<i64> = ends.chunks(2).map(|ends| ends[1] - ends[0] + 1).collect();
            assert_eq!(points, [4, 3, 2]);
        }
        let found: Vec<f32> = array::<4>(&file, "density").into_iter().map(f32::from_le_bytes).collect();
        assert_eq!(found, values);
    }
}
