//! How far a time step of a scene is off.
//!
//! A small piece of the fluid, at the density of the stiffest part of the scene, has the frequency ω of its fastest species
//! ([`psidpd_dynamics::trial`]) and the rate κ = 2 ⟨Σ D/μ⟩/(dN) at which drag takes kinetic energy. Where ωΔt is small, the
//! errors are those of the rule in `docs/integrators.md`; where it is not, the piece tries the step and measures them.
//!
//! A liquid in equilibrium with its vapour has the carried pressure of the vapour: it is thinner by the error over ρ ∂p/∂ρ, which a
//! second piece gives, a little denser.

use psidpd_dynamics::integrator::{Integrator, Rates};
use psidpd_dynamics::prediction::predict;
use psidpd_dynamics::run::RunError;
use psidpd_dynamics::scene::{Scene, Stage};
use psidpd_dynamics::trial::{Composition, NoPiece, Piece};
use serde::Serialize;

/// Up to this ωΔt, and this κΔt where drag is among the forces, the rule holds.
const RULE: f64 = 0.25;
const RULE_OF_DRAG: f64 = 0.3;

/// Errors of the step of fourth order up to the ωΔt of the reference are less than this.
const NONE: f64 = 0.002;

/// Pieces of a scene among which the stiffest is sought, at most.
const PIECES: usize = 3;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepEstimate {
    pub stage: String,
    pub integrator: String,
    pub dt: f64,
    /// Frequency ω of the fastest species.
    pub frequency: f64,
    /// The root mean square frequency of all particles, of ∇²U; none where forces jump.
    pub mean_frequency: Option<f64>,
    /// Drag κ.
    pub drag: f64,
    /// Relative error of the temperatures, the larger of the kinetic and the configurational one; infinite where the fluid does not last.
    pub error: f64,
    /// Error of the pressure of the momentum flux, in ρkT.
    pub carried: f64,
    /// Errors below this are not told from none.
    pub resolution: f64,
    /// By what share a liquid in equilibrium with its vapour is not dense enough, if the fluid resists compression.
    pub thinner: Option<f64>,
    /// The longest Δt with errors of about 0.01, if one is known.
    pub one_percent: Option<f64>,
}

/// A step of which nothing can be said, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnknownStep {
    pub stage: String,
    pub integrator: String,
    pub dt: f64,
    pub why: String,
}

/// What is known of the steps of a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Steps {
    pub known: Vec<StepEstimate>,
    pub unknown: Vec<UnknownStep>,
}

/// Why steps without drag have no estimate.
const NO_DRAG: &str =
    "nothing takes the heat that steps add, so the error grows with the length of the stage";

/// The errors of the steps of each stage with conditions of its own; of a ramp those of the first level and the last.
pub fn estimates(scene: &Scene) -> Result<Steps, RunError> {
    let mut found: Vec<StepEstimate> = Vec::new();
    let mut unknown: Vec<UnknownStep> = Vec::new();
    let mut known: Vec<(f64, Result<Sample, NoPiece>)> = Vec::new();
    let mut longest: Vec<(f64, Integrator, Option<f64>)> = Vec::new();
    let at_an_end = |stage: &&Stage| stage.level.is_none_or(|[level, levels]| level == 1 || level == levels);
    let timed = scene.stages.iter().filter(|stage| stage.integrator.has_time());
    for stage in timed.filter(at_an_end) {
        let at = match known.iter().position(|(kt, _)| *kt == stage.kt) {
            Some(at) => at,
            None => {
                known.push((stage.kt, sampled(scene, stage.kt)?));
                known.len() - 1
            }
        };
        let untold = |why: String| UnknownStep {
            stage: stage.name.clone(),
            integrator: stage.integrator.to_string(),
            dt: stage.dt,
            why,
        };
        let sample = match &known[at].1 {
            Ok(sample) => sample,
            Err(why) => {
                unknown.push(untold(why.to_string()));
                continue;
            }
        };
        let Some([error, carried, resolution]) = errors(&sample.piece, stage)? else {
            unknown.push(untold(NO_DRAG.to_owned()));
            continue;
        };
        let one_percent = match longest.iter().find(|(kt, of, _)| (*kt, *of) == (stage.kt, stage.integrator))
        {
            Some((.., dt)) => *dt,
            None => {
                let dt = one_percent(&sample.piece, stage)?;
                longest.push((stage.kt, stage.integrator, dt));
                dt
            }
        };
        let resistance = sample.resistance;
        let estimate = StepEstimate {
            stage: stage.name.clone(),
            integrator: stage.integrator.to_string(),
            dt: stage.dt,
            frequency: sample.piece.frequency,
            mean_frequency: sample.piece.mean_frequency,
            drag: drag(&sample.piece, stage),
            error,
            carried,
            resolution,
            thinner: resistance.map(|resistance| carried * stage.kt / resistance),
            one_percent,
        };
        let same = |other: &&StepEstimate| {
            other.integrator == estimate.integrator
                && (other.dt, other.error) == (estimate.dt, estimate.error)
        };
        if !found.iter().any(|other| same(&other)) {
            found.push(estimate);
        }
    }
    unknown.dedup();
    Ok(Steps { known: found, unknown })
}

fn is_fourth_order(stage: &Stage) -> bool {
    matches!(stage.integrator, Integrator::ForceGradient { .. })
}

/// Errors by the rule: of the temperature of configurations, and of the carried pressure.
fn by_rule(piece: &Piece, stage: &Stage, dt: f64) -> Option<[f64; 2]> {
    let frequency = if is_fourth_order(stage) { Some(piece.frequency) } else { piece.mean_frequency };
    let of_drag = |rate: f64| if stage.thermostat { rate } else { 0.0 };
    let rates = Rates { frequency: frequency?, drag: of_drag(piece.drag), crossing: of_drag(piece.crossing) };
    Some(stage.integrator.properties().accuracy.errors(dt, rates))
}

fn drag(piece: &Piece, stage: &Stage) -> f64 {
    if stage.thermostat { piece.drag } else { 0.0 }
}

/// Errors of the temperatures and of the carried pressure, and what is not told from none; `None` where nothing is known.
fn errors(piece: &Piece, stage: &Stage) -> Result<Option<[f64; 3]>, RunError> {
    let rule = by_rule(piece, stage, stage.dt);
    let lost = if stage.integrator.properties().drag_in_forces { drag(piece, stage) } else { 0.0 };
    if piece.frequency * stage.dt <= RULE
        && lost * stage.dt <= RULE_OF_DRAG
        && let Some([error, carried]) = rule
    {
        let resolution = if is_fourth_order(stage) { NONE } else { 0.0 };
        return Ok(Some([error, carried, resolution]));
    }
    if !stage.thermostat || piece.drag <= 0.0 {
        // Heat that steps add stays, so the error depends on how long the stage is.
        return Ok(None);
    }
    let Some(found) = piece.errors(stage.integrator, stage.dt)? else {
        return Ok(Some([f64::INFINITY, f64::INFINITY, 0.0]));
    };
    // Steps of lower order carry a wrong pressure at right temperatures.
    let carried = rule.filter(|_| !is_fourth_order(stage)).map_or(0.0, |rule| rule[1]);
    Ok(Some([found.temperatures(), found.carried().max(carried), found.resolution()]))
}

/// The longest Δt with errors of about 0.01.
fn one_percent(piece: &Piece, stage: &Stage) -> Result<Option<f64>, RunError> {
    if !is_fourth_order(stage) {
        let error = |dt| by_rule(piece, stage, dt).map(|errors| errors[0].max(errors[1]));
        return Ok(error(1.0).map(|_| longest(|dt| error(dt).unwrap_or(f64::INFINITY)).min(piece.cap())));
    }
    if !stage.thermostat || piece.drag <= 0.0 {
        return Ok(None);
    }
    Ok(piece.longest(stage.integrator)?.map(|(dt, _)| dt))
}

/// The Δt at which an error that grows is 0.01.
fn longest(error: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = [1e-9f64, 1e9];
    for _ in 0..80 {
        let middle = (low * high).sqrt();
        if error(middle) > 0.01 { high = middle } else { low = middle }
    }
    low
}

#[derive(Debug)]
struct Sample {
    piece: Piece,
    /// ∂p/∂ρ at constant composition, if positive.
    resistance: Option<f64>,
}

const DENSER: f64 = 1.04;

fn total(densities: &[f64]) -> f64 {
    densities.iter().sum()
}

/// The fluid of a scene where its particles are fastest; why there is none, if a denser part cannot be tried.
fn sampled(scene: &Scene, kt: f64) -> Result<Result<Sample, NoPiece>, RunError> {
    let mut fastest: Option<(Piece, Vec<f64>)> = None;
    let mut unknown = (0.0, NoPiece::Empty);
    for densities in compositions(scene, kt)? {
        match (settled(scene, kt, &densities)?, &fastest) {
            (Ok(piece), Some((other, _))) if piece.frequency <= other.frequency => {}
            (Ok(piece), _) => fastest = Some((piece, densities)),
            (Err(why), _) if total(&densities) >= unknown.0 => unknown = (total(&densities), why),
            (Err(_), _) => {}
        }
    }
    let (piece, densities) = match fastest {
        Some((piece, densities)) if total(&densities) >= unknown.0 => (piece, densities),
        _ => return Ok(Err(unknown.1)),
    };
    let denser: Vec<f64> = densities.iter().map(|rho| DENSER * rho).collect();
    let compressed = settled(scene, kt, &denser)?.ok().map(|piece| piece.pressure);
    let resistance =
        compressed.map(|compressed| (compressed - piece.pressure) / ((DENSER - 1.0) * total(&densities)));
    Ok(Ok(Sample { piece, resistance: resistance.filter(|resistance| *resistance > 0.0) }))
}

fn settled(scene: &Scene, kt: f64, densities: &[f64]) -> Result<Result<Piece, NoPiece>, RunError> {
    Piece::settled(&Composition { model: &scene.model, masses: &scene.mass, kt, densities, seed: scene.seed })
}

/// Theory's liquids are up to 8 % denser than those of runs (the table of `docs/running.md`): a start as dense as that condenses no further.
const TOO_DENSE: f64 = 1.1;

/// The densities of the species in the parts of a scene, and of the liquid that a thinner start condenses to.
fn compositions(scene: &Scene, kt: f64) -> Result<Vec<Vec<f64>>, RunError> {
    let densities = scene.densities();
    let mut parts = scene.densities_of_parts();
    // Of one species a thinner part is never stiffer.
    parts.retain(|rho| *rho != densities && (rho.len() > 1 || total(rho) > 1.02 * total(&densities)));
    parts.sort_by(|a, b| total(b).total_cmp(&total(a)));
    let mut all = vec![densities];
    all.append(&mut parts);
    all.truncate(PIECES);
    if let [rho] = all[0][..]
        && let Some(theory) = predict(&scene.model.at(kt)?, Some(rho))
        && let Ok(phases) = &theory.phases
    {
        let liquid = theory.correlated_liquid.unwrap_or(phases.liquid);
        if (phases.vapour..liquid / TOO_DENSE).contains(&rho) {
            all.push(vec![liquid]);
        }
    }
    Ok(all)
}
