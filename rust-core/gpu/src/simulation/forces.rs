//! Forces for a host that keeps the particles, such as LAMMPS: positions and velocities go to the device, forces come back.
//!
//! A rank's ghosts are particles of the device that only others see. Between the two halves of an evaluation slopes of the
//! rank's own particles go to the host, and those of its ghosts come back.

use super::GpuSimulation;
use super::arrays::{COUNTS, EXCHANGE, POSITIONS, STATUS, SUMS, VELOCITIES};
use super::status::Status;
use super::{read, sums_of};
use crate::geometry::Geometry;
use crate::{Device, Fault, GpuError, Settings};
use psidpd_core::engine::{
    Around, DevicePath, EngineError, Evaluate, PeriodicBox, Request, Surroundings, Tally,
};
use psidpd_core::model::Fluid;

/// The bit of ghosts beside their species.
const GHOST: u32 = 0x8000;
/// Largest width of a rank, in cutoffs, whose coordinates have the resolution that forces need.
const WIDEST: f64 = 2e4;

/// A device as a path of [`Engine`](psidpd_core::engine::Engine).
#[derive(Debug)]
pub struct GpuForces {
    machine: GpuSimulation,
    species_of_kind: Vec<i32>,
    /// The host's index of each particle on the device, owned ones first.
    places: Vec<u32>,
    /// Number of owned particles on the device.
    owned: usize,
    slopes: Vec<f64>,
    positions: Vec<[u32; 4]>,
    velocities: Vec<[f32; 4]>,
}

fn failed(error: GpuError) -> EngineError {
    EngineError::Device(error.to_string())
}

impl GpuForces {
    /// Compiles the kernels of a fluid. Types are species indices unless they are mapped.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] names what the device cannot compute.
    pub fn new(device: &Device, fluid: &Fluid) -> Result<GpuForces, GpuError> {
        let species = fluid.species.len();
        let settings = Settings {
            domain: PeriodicBox::OPEN,
            mass: vec![1.0; species],
            seed: 0,
            thermostat: true,
            body_forces: Vec::new(),
        };
        Ok(GpuForces {
            machine: GpuSimulation::new(device, fluid, settings)?,
            species_of_kind: (0..species as i32).collect(),
            places: Vec::new(),
            owned: 0,
            slopes: Vec::new(),
            positions: Vec::new(),
            velocities: Vec::new(),
        })
    }

    /// Slopes of a particle.
    fn width(&self) -> usize {
        self.machine.kernels.shader().variables
    }

    /// The host's box along its periods; along other directions all that the owned particles at `x` see.
    fn region(&self, domain: &PeriodicBox, x: &[[f64; 3]]) -> Result<PeriodicBox, EngineError> {
        let dimensions = self.machine.fluid.dimensions;
        let is_open = |k: usize| k >= dimensions || !domain.periodic()[k];
        if !(0..dimensions).any(is_open) {
            return Ok(domain.clone());
        }
        let cutoff = self.machine.fluid.cutoff() * (1.0 + 1e-6);
        let (mut origin, mut lengths) = (domain.origin(), domain.lengths());
        for k in (0..3).filter(|k| is_open(*k)) {
            let ends = |[low, high]: [f64; 2], x: &[f64; 3]| [low.min(x[k]), high.max(x[k])];
            let [low, high] = x.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends);
            (origin[k], lengths[k]) = (low - cutoff, high - low + 2.0 * cutoff);
            if k < dimensions && lengths[k] > WIDEST * cutoff {
                return Err(EngineError::Device(format!(
                    "the atoms of a rank are up to {:.3e} apart, which leaves too few digits for their distances on a gpu",
                    high - low
                )));
            }
        }
        PeriodicBox::orthogonal(origin, lengths, domain.periodic())
            .map_err(|error| EngineError::Device(error.to_string()))
    }

    /// Copies particles to the device, and puts them into the order of cells.
    fn load(&mut self, around: Around, request: &Request) -> Result<(), EngineError> {
        let psidpd_core::engine::Particles { owned, x, tag, kind } = request.particles;
        let drag = request.step.is_some() && self.machine.has_drag();
        if [tag.len(), kind.len()] != [x.len(); 2] || owned > x.len() || drag && request.v.len() != x.len() {
            return Err(EngineError::Host("particle arrays have different lengths"));
        }
        self.places.clear();
        self.positions.clear();
        self.velocities.clear();
        self.owned = 0;
        if owned == 0 {
            return Ok(());
        }
        if let Some(k) = x[..owned].iter().position(|x| !x.iter().all(|x| x.is_finite())) {
            return Err(EngineError::Position { tag: tag[k] });
        }
        let domain = self.region(around.domain, &x[..owned])?;
        let machine = &mut self.machine;
        let geometry =
            Geometry::new(&domain, machine.fluid.dimensions, machine.fluid.cutoff()).map_err(failed)?;
        for k in 0..x.len() {
            let species = usize::try_from(kind[k]).ok().and_then(|kind| self.species_of_kind.get(kind));
            let species = *species.ok_or(EngineError::Kind { tag: tag[k], kind: kind[k] })?;
            if tag[k] <= 0 {
                return Err(EngineError::Tag { tag: tag[k] });
            }
            let is_ghost = k >= owned;
            if species < 0 || is_ghost && around.images.get(k - owned) == Some(&true) {
                continue;
            }
            let Some((s, _)) = geometry.coordinates(x[k]) else {
                // No particle of this rank sees a ghost beyond its region.
                if is_ghost {
                    continue;
                }
                return Err(EngineError::Position { tag: tag[k] });
            };
            let [vx, vy, vz] = if drag { request.v[k].map(|v| v as f32) } else { [0.0; 3] };
            let word = species as u32 | if is_ghost { GHOST } else { 0 };
            self.places.push(k as u32);
            self.positions.push([s[0], s[1], s[2], tag[k] as u32]);
            self.velocities.push([vx, vy, vz, f32::from_bits(word)]);
            self.owned += usize::from(!is_ghost);
        }
        machine.kernels.set_tilted(geometry.is_tilted);
        (machine.geometry, machine.count, machine.side) = (geometry, self.places.len(), 0);
        let (count, cells) = (machine.count, machine.cells());
        let fits = |(most, most_cells)| count <= most && cells <= most_cells;
        if !machine.arrays.as_ref().is_some_and(|arrays| fits(arrays.room)) {
            machine.arrays = None;
            let width = machine.kernels.shader().variables.max(3) as u64;
            machine.allocate_room((count + count / 8, cells + cells / 4), false, width).map_err(failed)?;
        }
        machine.write_params();
        machine.clear_status();
        let Some(arrays) = &machine.arrays else { return Ok(()) };
        let queue = &machine.device.queue;
        queue.write_buffer(&arrays.buffers[POSITIONS], 0, bytemuck::cast_slice(&self.positions));
        queue.write_buffer(&arrays.buffers[VELOCITIES], 0, bytemuck::cast_slice(&self.velocities));
        let mut encoder = machine.device.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&arrays.buffers[COUNTS], 0, None);
        queue.submit([encoder.finish()]);
        let list = machine.record(|runs| {
            runs.all("count_cells", [0.0; 4], 0);
            runs.sort();
        });
        machine.submit(&list).map_err(failed)
    }

    /// Reads `width` numbers of each owned particle and, if asked for, the totals; fails if a kernel found a fault.
    fn collect(&mut self, width: usize, totals: bool) -> Result<(Vec<f32>, Status, Tally), EngineError> {
        let numbers = self.owned * width;
        let machine = &mut self.machine;
        let Some(arrays) = &machine.arrays else {
            return Err(EngineError::Host("nothing has been evaluated"));
        };
        let sums = if totals { machine.bytes_of_sums() } else { 0 };
        let status = size_of::<Status>();
        let parts = [(EXCHANGE, 4 * numbers as u64), (STATUS, status as u64), (SUMS, sums)]
            .map(|(k, bytes)| (&arrays.buffers[k], bytes));
        let mut found: Vec<f32> = read(&machine.device, &parts).map_err(failed)?;
        let status: Status =
            bytemuck::pod_read_unaligned(bytemuck::cast_slice(&found[numbers..][..status / 4]));
        if let Some(stop) = machine.fault(&status, 0) {
            let tag = stop.tag;
            return Err(match stop.fault {
                Fault::Force => EngineError::Force { tag },
                Fault::ExcessFreeEnergy => EngineError::Device(format!(
                    "the excess free energy of particle {tag} is not finite: psi is singular there; set bounds on the \
                     density, or lower the time step"
                )),
                Fault::Velocity | Fault::Runaway => EngineError::Device(stop.to_string()),
            });
        }
        let tally = sums_of(&found[numbers + size_of::<Status>() / 4..]).tally;
        found.truncate(numbers);
        Ok((found, status, tally))
    }

    /// Copies the slopes of owned particles to the host, with room for `all`.
    fn give_slopes(&mut self, all: usize) -> Result<(), EngineError> {
        let width = self.width();
        self.slopes.clear();
        self.slopes.resize(all * width, 0.0);
        if width == 0 || self.places.is_empty() {
            return Ok(());
        }
        let list = self.machine.record(|runs| runs.all("give_slopes", [0.0; 4], 0));
        self.machine.submit(&list).map_err(failed)?;
        let (found, ..) = self.collect(width, false)?;
        for (place, from) in self.places.iter().zip(found.chunks_exact(width)) {
            let to = *place as usize * width;
            self.slopes[to..to + width].iter_mut().zip(from).for_each(|(to, s)| *to = f64::from(*s));
        }
        Ok(())
    }

    /// The last kernels of an evaluation. Adds the forces to those of the host.
    fn finish(
        &mut self,
        request: &Request,
        force: &mut [[f64; 3]],
        densities: bool,
    ) -> Result<Tally, EngineError> {
        if self.places.is_empty() {
            return Ok(Tally::default());
        }
        let totals = request.want.energy || request.want.virial;
        let machine = &mut self.machine;
        let noise = request.step.and_then(|step| machine.noise(step.seed, step.dt, step.number));
        let list = machine.record(|runs| {
            if densities {
                runs.densities(totals);
            }
            runs.pair_forces(totals, noise);
            runs.all("give_forces", [0.0; 4], 0);
        });
        machine.submit(&list).map_err(failed)?;
        let (found, status, tally) = self.collect(3, totals)?;
        self.machine.count_status(&status);
        for (place, f) in self.places.iter().zip(found.as_chunks::<3>().0) {
            let Some(sum) = force.get_mut(*place as usize) else {
                return Err(EngineError::Host("there is no room for the forces on owned particles"));
            };
            (0..3).for_each(|k| sum[k] += f64::from(f[k]));
        }
        Ok(tally)
    }
}

impl Evaluate for GpuForces {
    fn whole(
        &mut self,
        domain: &PeriodicBox,
        request: &Request,
        force: &mut [[f64; 3]],
        add: bool,
    ) -> Result<Tally, EngineError> {
        if !add {
            force.fill([0.0; 3]);
        }
        self.load(Around { domain, images: &[] }, request)?;
        self.finish(request, force, true)
    }

    fn first(
        &mut self,
        surroundings: Surroundings,
        request: &Request,
        _: &mut [[f64; 3]],
    ) -> Result<(), EngineError> {
        let around = surroundings.around().ok_or(EngineError::Host("a gpu finds its pairs itself"))?;
        self.load(around, request)?;
        if self.width() > 0 && !self.places.is_empty() {
            let totals = request.want.energy || request.want.virial;
            let list = self.machine.record(|runs| runs.densities(totals));
            self.machine.submit(&list).map_err(failed)?;
        }
        self.give_slopes(request.particles.x.len())
    }

    fn second(&mut self, request: &Request, force: &mut [[f64; 3]]) -> Result<Tally, EngineError> {
        let width = self.width();
        if width == 0 || self.places.is_empty() {
            return self.finish(request, force, true);
        }
        let ghosts = self.places[self.owned..].iter().map(|k| *k as usize * width);
        let slopes: Vec<f32> =
            ghosts.flat_map(|k| self.slopes[k..k + width].iter().map(|s| *s as f32)).collect();
        if let Some(arrays) = &self.machine.arrays {
            let to = 4 * (self.owned * width) as u64;
            let buffer = &arrays.buffers[EXCHANGE];
            self.machine.device.queue.write_buffer(buffer, to, bytemuck::cast_slice(&slopes));
        }
        let list = self.machine.record(|runs| runs.all("take_slopes", [0.0; 4], 0));
        self.machine.submit(&list).map_err(failed)?;
        self.finish(request, force, false)
    }

    fn slopes_mut(&mut self) -> &mut Vec<f64> {
        &mut self.slopes
    }

    fn fetch_slopes(&mut self, all: usize) {
        if self.give_slopes(all).is_err() {
            self.slopes.fill(f64::NAN);
        }
    }
}

impl DevicePath for GpuForces {
    fn name(&self) -> String {
        self.machine.device.info().to_string()
    }

    fn fits(&self, domain: &PeriodicBox) -> bool {
        let (dimensions, cutoff) = (self.machine.fluid.dimensions, self.machine.fluid.cutoff());
        let open = !domain.periodic()[..dimensions].contains(&true);
        open || Geometry::new(domain, dimensions, cutoff).is_ok()
    }

    fn set_fluid(&mut self, fluid: &Fluid) -> Result<(), EngineError> {
        let machine = &mut self.machine;
        let shader = crate::shader::Shader::new(fluid).map_err(|error| failed(error.into()))?;
        machine.kernels.replace(&machine.device, shader).map_err(failed)?;
        (machine.fluid, machine.arrays) = (fluid.clone(), None);
        Ok(())
    }

    fn map_kinds(&mut self, kinds: &[i32]) {
        self.species_of_kind = kinds.to_vec();
    }

    fn out_of_bounds(&self) -> [u64; 2] {
        self.machine.out_of_bounds
    }
}
