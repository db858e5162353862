//! The weighted local density on a grid, and the files of a run for VTK.

use super::FieldOptions;
use psidpd_core::model::kernel::Kernel;
use psidpd_formats::files::{PathError, folder_inside, names_inside, remove_if_there, replace_inside};
use psidpd_formats::{FormatError, Frame, Grid, write_vti, write_vtp};
use std::path::{Path, PathBuf};

/// The folder of these files in that of a run.
pub const VTK: &str = "vtk";

/// Points of the grid within the range of the weight function.
const FINE: f64 = 3.0;
/// The most cells of the grid along an edge of the box.
const MOST: f64 = 256.0;

/// The weighted local density `n(r) = Σ_j w(|r − r_j|)` on a grid that spans the box: `density` of all particles, and, of several
/// species, `density_NAME` of each. Points are a third of the range of the weight function apart, or a little less, but no
/// more than 257 along an edge. A species without particles has the density 0.
///
/// Returns `None` for a box with edges that are not along the axes.
pub fn density_grid(frame: &Frame, kernel: Option<Kernel>) -> Option<Grid> {
    let kernel = kernel.unwrap_or(FieldOptions::coarse(frame.dimensions).kernel);
    let lengths = frame.domain.lengths();
    if (0..3).any(|k| frame.domain.edge(k)[k] != lengths[k]) {
        return None;
    }
    let cells: [usize; 3] = std::array::from_fn(|k| match (k, frame.dimensions) {
        (2, 2) => 0,
        _ => (FINE * lengths[k] / kernel.range()).ceil().clamp(1.0, MOST) as usize,
    });
    let size = cells.map(|n| n + 1);
    let spacing: [f64; 3] = std::array::from_fn(|k| lengths[k] / cells[k].max(1) as f64);
    let mut origin = frame.domain.origin();
    if frame.dimensions == 2 {
        origin[2] = frame.x.first().map_or(0.0, |x| x[2]);
    }
    let kinds = if frame.names.len() > 1 { frame.names.len() } else { 0 };
    let mut values = vec![vec![0.0; size.iter().product()]; 1 + kinds];
    let periodic = frame.periodic();
    let square_of_range = kernel.range() * kernel.range();
    for (x, species) in frame.x.iter().zip(frame.species) {
        // For each direction the distances of the points in range, and their numbers in the grid. The last point of a
        // periodic direction is the first of the next box, so that each point has its own share of images.
        let near: [Vec<(f64, usize)>; 3] = std::array::from_fn(|k| {
            let place = (x[k] - origin[k]) / spacing[k];
            let reach = kernel.range() / spacing[k];
            let (low, high) = ((place - reach).ceil() as i64, (place + reach).floor() as i64);
            let mut points = Vec::new();
            for point in low..=high {
                let off = (point as f64 - place) * spacing[k];
                if !periodic[k] {
                    points.extend(usize::try_from(point).ok().filter(|p| *p < size[k]).map(|p| (off, p)));
                    continue;
                }
                let first = point.rem_euclid(cells[k] as i64) as usize;
                points.push((off, first));
                if first == 0 {
                    points.push((off, cells[k]));
                }
            }
            points
        });
        for (dz, k) in &near[2] {
            for (dy, j) in &near[1] {
                let aside = dy * dy + dz * dz;
                let row = (k * size[1] + j) * size[0];
                // A ball fills half of the cube around it.
                for (square, i) in
                    near[0].iter().map(|(dx, i)| (dx * dx + aside, i)).filter(|(s, _)| *s < square_of_range)
                {
                    let w = kernel.value(square.sqrt());
                    values[0][row + i] += w;
                    if kinds > 0 {
                        values[1 + *species as usize][row + i] += w;
                    }
                }
            }
        }
    }
    let names = frame.names.iter().take(kinds).map(|name| format!("density_{name}"));
    let names = ["density".to_owned()].into_iter().chain(names);
    let fields = names.zip(values).map(|(name, v)| (name, v.into_iter().map(|x: f64| x as f32).collect()));
    Some(Grid { origin, spacing, size, fields: fields.collect() })
}

/// Writes the particles and their density into the folder of VTK's files of a run, each file whole or not at all. The folder is
/// created if it does not exist. A box with edges that are not along the axes gets no density.
pub fn write_vtk(folder: &Path, frame: &Frame, kernel: Option<Kernel>) -> Result<(), FormatError> {
    let folder = folder.join(VTK);
    folder_inside(&folder).map_err(PathError::at("write", &folder))?;
    // The resumed run makes the same step.
    let mut bytes = Vec::new();
    write_vtp(frame, &mut bytes).map_err(PathError::at("write", &folder))?;
    replace_inside(&folder.join(format!("particles-{:010}.vtp", frame.step)), &bytes, false)?;
    if let Some(grid) = density_grid(frame, kernel) {
        bytes.clear();
        write_vti(&grid, frame, &mut bytes).map_err(PathError::at("write", &folder))?;
        replace_inside(&folder.join(format!("density-{:010}.vti", frame.step)), &bytes, false)?;
    }
    Ok(())
}

/// Removes VTK's files of an earlier run from the folder of a run.
pub fn remove_vtk(folder: &Path) -> Result<(), FormatError> {
    for path in vtk_files(folder) {
        remove_if_there(&path).map_err(PathError::at("write", &path))?;
    }
    Ok(())
}

/// VTK's files in the folder of a run.
pub fn vtk_files(folder: &Path) -> Vec<PathBuf> {
    let own = [("particles-", ".vtp"), ("density-", ".vti"), ("unfinished", ".new")];
    let is_own = |name: &str| own.iter().any(|(start, end)| name.starts_with(start) && name.ends_with(end));
    let folder = folder.join(VTK);
    let names = names_inside(&folder).into_iter().filter(|name| name.to_str().is_some_and(is_own));
    names.map(|name| folder.join(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::PeriodicBox;
    use psidpd_core::model::kernel::KernelKind;

    /// Each value is the sum over all images, in boxes with and without walls, also narrower than the range.
    #[test]
    fn values_are_sums_over_all_images() {
        let x = [[1.1, -0.9, 0.1], [3.9, 0.9, 2.4], [2.5, 0.1, 1.2]];
        let names = ["A".to_owned(), "B".to_owned()];
        for (dimensions, periodic) in [(3, [true; 3]), (3, [true, false, true]), (2, [true, true, false])] {
            let domain = PeriodicBox::orthogonal([1.0, -1.0, 0.0], [3.0, 2.0, 2.5], periodic).unwrap();
            let x = x.map(|x| if dimensions == 2 { [x[0], x[1], 0.5] } else { x });
            let (species, tag) = (&[0, 1, 0][..], &[1, 2, 3][..]);
            let domain = &domain;
            let frame =
                Frame { step: 0, time: 0.0, dimensions, domain, names: &names, x: &x, v: None, species, tag };
            let kernel = Kernel::new(KernelKind::Quadratic, 2.2, dimensions);
            let grid = density_grid(&frame, Some(kernel)).unwrap();
            assert_eq!(grid.size, [6, 4, if dimensions == 3 { 5 } else { 1 }]);
            let images = |periodic: bool| if periodic { -2..=2 } else { 0..=0 };
            for at in 0..grid.size.iter().product() {
                let [i, j, k] =
                    [at % grid.size[0], at / grid.size[0] % grid.size[1], at / grid.size[0] / grid.size[1]];
                let point: [f64; 3] =
                    std::array::from_fn(|c| grid.origin[c] + [i, j, k][c] as f64 * grid.spacing[c]);
                let mut sums = [0.0; 3];
                for (x, s) in x.iter().zip(species) {
                    for a in images(periodic[0]) {
                        for b in images(periodic[1]) {
                            for c in images(periodic[2]) {
                                let d = [a as f64 * 3.0, b as f64 * 2.0, c as f64 * 2.5];
                                let square: f64 = (0..3).map(|k| (x[k] + d[k] - point[k]).powi(2)).sum();
                                let w = kernel.value(square.sqrt());
                                sums[0] += w;
                                sums[1 + *s as usize] += w;
                            }
                        }
                    }
                }
                for ((name, values), sum) in grid.fields.iter().zip(sums) {
                    let value = f64::from(values[at]);
                    assert!(
                        (value - sum).abs() < 1e-6,
                        "{dimensions} {periodic:?} {name} {at}: {value} {sum}"
                    );
                }
            }
            let fields: Vec<&str> = grid.fields.iter().map(|(name, _)| name.as_str()).collect();
            assert_eq!(fields, ["density", "density_A", "density_B"]);
        }
    }
}
