use super::state::State;
use super::{About, Value};

/// Names and values at the top of the page.
///
/// `timing` has the sessions of a resumed run; an older `summary` has one time.
pub fn facts(
    about: Option<&About>,
    summary: Option<&Value>,
    timing: Option<&Value>,
    state: Option<&State>,
) -> Vec<(String, String)> {
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut fact = |name: &str, value: String| facts.push((name.to_owned(), value));
    if let Some(a) = about {
        fact("model", a.model.clone());
        fact("kT", a.kt.to_string());
        fact("species", a.species.join(", "));
        fact("box", lengths(a));
        fact("seed", a.seed.to_string());
        if !a.precision.is_empty() {
            fact("precision", a.precision.clone());
        }
        if a.device.starts_with("gpu") {
            fact("device", a.device.clone());
        }
    }
    let number = |key: &str| summary.and_then(|s| s.get(key)).and_then(Value::as_f64);
    let particles = number("particles").or_else(|| Some(state?.configuration.x.len() as f64));
    if let Some(n) = particles {
        let density = about.map(|a| n / a.volume()).filter(|d| d.is_finite());
        let density = density.map_or(String::new(), |d| format!(" (mean number density {d:.4})"));
        fact("particles", format!("{n}{density}"));
    }
    if let Some(a) = about {
        let stage = |s: &psidpd_formats::AboutStage| {
            let thermostat = if s.thermostat { "" } else { ", thermostat off" };
            let kt = if s.kt == a.kt { String::new() } else { format!(", kT {}", s.kt) };
            format!("{} (steps {}–{}, Δt {}, {}{kt}{thermostat})", s.name, s.begin, s.end, s.dt, s.integrator)
        };
        fact("stages", a.stages.iter().map(stage).collect::<Vec<_>>().join("; "));
    }
    if summary.is_none() {
        fact("state of the run", "there is no summary.json: the run is not over, or was stopped".into());
    }
    if let Some((seconds, speed)) = wall_time(summary, timing) {
        let speed = speed.map_or(String::new(), |s| format!(", {s:.3e} particle-steps per second"));
        fact("wall time", format!("{seconds:.1} s{speed}"));
    }
    let beyond = summary.and_then(|s| s.get("out_of_bounds")).and_then(Value::as_array);
    if let Some([below, above]) = beyond.map(Vec::as_slice)
        && (below.as_u64() != Some(0) || above.as_u64() != Some(0))
    {
        fact("ψ beyond the bounds of a density", format!("{below} times below, {above} times above"));
    }
    if let Some(a) = about {
        fact("units", a.units.clone());
        fact("written by", a.program.clone());
    }
    facts
}

/// The wall time in seconds, and particle-steps per second.
fn wall_time(summary: Option<&Value>, timing: Option<&Value>) -> Option<(f64, Option<f64>)> {
    let number = |value: &Value, key: &str| value.get(key).and_then(Value::as_f64);
    let Some(sessions) = timing.and_then(|t| t.get("sessions")).and_then(Value::as_array) else {
        return summary
            .and_then(|s| Some((number(s, "wall_seconds")?, number(s, "particle_steps_per_second"))));
    };
    let (mut seconds, mut work) = (0.0, 0.0);
    for session in sessions {
        let time = number(session, "wall_seconds")?;
        seconds += time;
        work += time * number(session, "particle_steps_per_second")?;
    }
    (seconds > 0.0).then(|| (seconds, Some(work / seconds)))
}

fn lengths(about: &About) -> String {
    let length = |e: &[f64; 3]| e[0].hypot(e[1]).hypot(e[2]);
    let sides: Vec<String> = about.box_edges[..about.dimensions.clamp(2, 3)]
        .iter()
        .zip(about.box_periodic)
        .map(|(e, periodic)| format!("{}{}", length(e), if periodic { "" } else { " (not periodic)" }))
        .collect();
    sides.join(" × ")
}
