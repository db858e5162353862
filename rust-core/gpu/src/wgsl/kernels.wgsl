// The shapes W(s) of weight functions and their slopes, by the names of the model file, for s < 1.

fn value_linear(s: f32) -> f32 { return 1.0 - s; }
fn slope_linear(s: f32) -> f32 { return -1.0; }

fn value_quadratic(s: f32) -> f32 { return (1.0 - s) * (1.0 - s); }
fn slope_quadratic(s: f32) -> f32 { return -2.0 * (1.0 - s); }

fn value_bell(s: f32) -> f32 { return 1.0 + s * s * (2.0 * s - 3.0); }
fn slope_bell(s: f32) -> f32 { return 6.0 * s * (s - 1.0); }

fn value_lucy(s: f32) -> f32 { let t = 1.0 - s; return (1.0 + 3.0 * s) * t * t * t; }
fn slope_lucy(s: f32) -> f32 { let t = 1.0 - s; return -12.0 * s * t * t; }

fn value_cubic_spline(s: f32) -> f32 {
    let t = 1.0 - s;
    let u = max(0.5 - s, 0.0);
    return 2.0 * (t * t * t) - 8.0 * (u * u * u);
}
fn slope_cubic_spline(s: f32) -> f32 {
    let t = 1.0 - s;
    let u = max(0.5 - s, 0.0);
    return 24.0 * (u * u) - 6.0 * (t * t);
}

fn value_wendland_c2(s: f32) -> f32 { let t = (1.0 - s) * (1.0 - s); return (1.0 + 4.0 * s) * t * t; }
fn slope_wendland_c2(s: f32) -> f32 { let t = 1.0 - s; return -20.0 * s * t * t * t; }
