// What all kernels share: arguments, arrays, geometry, noise and sums. `LANES`, `BLOCK`, `V` (variables of ψ) and so on
// are written in front of this text.

struct Params {
    count: u32,
    // A number that is not finite, which the compiler does not see.
    nan_bits: u32,
    body_forces: u32,
    blocks: u32,
    // Numbers of cells, and 1 for directions with walls.
    cells: vec4<u32>,
    walls: vec4<u32>,
    // Columns that turn differences of coordinates into vectors, and rows for the reverse.
    edge: array<vec4<f32>, 3>,
    row: array<vec4<f32>, 3>,
    // Accelerations, and the direction along which they are reversed (3 if along none).
    body: array<vec4<f32>, 15>,
    // Mass of each species, its inverse.
    mass: array<vec4<f32>, 64>,
}

// The arguments of one kernel.
struct Step {
    a: f32,
    b: f32,
    c: f32,
    d: f32,
    key: vec2<u32>,
    // Increases from kernel to kernel.
    sequence: u32,
    flags: u32,
}

struct Constants { c: array<vec4<f32>, CONSTANTS> }

struct Status {
    // The number of the kernel that failed first; 0 if none did.
    failed: atomic<u32>,
    // Lowest tag by reason.
    velocity: atomic<u32>,
    runaway: atomic<u32>,
    excess: atomic<u32>,
    force: atomic<u32>,
    unfinished: atomic<u32>,
    below: atomic<u32>,
    above: atomic<u32>,
    updates: u32,
    total_iterations: u32,
    inaccurate: u32,
    // Conjugate gradients: 0 going on, 1 at the last step, 2 done.
    state: u32,
    iterations: u32,
    first: f32,
    now: f32,
    drag: f32,
    alpha: f32,
    beta: f32,
    // Residual and direction of a mode without drag, in units of its first residual.
    residual: f32,
    direction: f32,
}

@group(0) @binding(0) var<uniform> P: Params;
@group(0) @binding(1) var<uniform> K: Constants;
// Coordinates and tag; velocity, with species and marks; boxes travelled, with the host's number of the particle.
@group(0) @binding(2) var<storage, read_write> pos: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> vel: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> box_of: array<vec4<i32>>;
@group(0) @binding(5) var<storage, read_write> sorted_pos: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> sorted_vel: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> sorted_box: array<vec4<i32>>;
@group(0) @binding(8) var<storage, read_write> force: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> counts: array<atomic<u32>>;
@group(0) @binding(10) var<storage, read_write> starts: array<u32>;
@group(0) @binding(11) var<storage, read_write> sums: array<u32>;
@group(0) @binding(12) var<storage, read_write> slots: array<vec2<u32>>;
@group(0) @binding(13) var<storage, read_write> slopes: array<f32>;
@group(0) @binding(14) var<storage, read_write> status: Status;
@group(0) @binding(15) var<storage, read_write> group_sums: array<f32>;
@group(0) @binding(16) var<storage, read_write> table: array<f32>;
// Conjugate gradients: residual, solution, direction and its image.
@group(0) @binding(17) var<storage, read_write> residual: array<vec4<f32>>;
// The same memory in steps and evaluations without them: undisplaced coordinates; forces or slopes for the host.
@group(0) @binding(17) var<storage, read_write> kept: array<vec4<u32>>;
@group(0) @binding(17) var<storage, read_write> exchange: array<f32>;
@group(0) @binding(18) var<storage, read_write> solution: array<vec4<f32>>;
@group(0) @binding(19) var<storage, read_write> direction: array<vec4<f32>>;
@group(0) @binding(20) var<storage, read_write> image: array<vec4<f32>>;

var<immediate> I: Step;

override TOTALS: bool = false;
// Whether the box has edges that are not along the axes.
override TILTED: bool = true;

const FLAG_DEFERRED = 1u;
const FLAG_NOISE = 4u;

// Whether an earlier kernel failed.
fn halted() -> bool {
    let failed = atomicLoad(&status.failed);
    return failed != 0u && failed < I.sequence;
}

// Whether i is a particle of this rank.
fn is_owned(i: u32) -> bool {
    if (halted() || i >= P.count) { return false; }
    return !is_ghost(vel[i]);
}

fn fail() {
    atomicStore(&status.failed, I.sequence);
}

fn species_of(v: vec4<f32>) -> u32 { return bitcast<u32>(v.w) & 0x7fffu; }
fn is_ghost(v: vec4<f32>) -> bool { return (bitcast<u32>(v.w) & 0x8000u) != 0u; }
fn marks_of(v: vec4<f32>) -> u32 { return bitcast<u32>(v.w) >> 16u; }
fn is_frozen(v: vec4<f32>) -> bool { return (bitcast<u32>(v.w) & 0x10000u) != 0u; }
fn inverse_mass(v: vec4<f32>) -> f32 { return select(P.mass[species_of(v)].y, 0.0, is_frozen(v)); }
fn mass_of(v: vec4<f32>) -> f32 { return P.mass[species_of(v)].x; }

// Comparisons of NaN may be optimised away; its bits are not.
fn is_finite(x: f32) -> bool { return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u; }
fn all_finite(x: vec3<f32>) -> bool { return is_finite(x.x) && is_finite(x.y) && is_finite(x.z); }

// ---- geometry

// The cell of a coordinate: its 20 leading bits times the number of cells.
fn cell_along(s: u32, k: u32) -> u32 {
    return ((s >> (12u - P.walls[k])) * P.cells[k]) >> 20u;
}

fn cell_of(s: vec4<u32>) -> vec3<u32> {
    return vec3(cell_along(s.x, 0u), cell_along(s.y, 1u), cell_along(s.z, 2u));
}

fn cell_index(c: vec3<u32>) -> u32 {
    return (c.z * P.cells.y + c.y) * P.cells.x + c.x;
}

// The first particle of a cell in the sorted order.
fn first_of(cell: u32) -> u32 { return starts[cell] + sums[cell / SCAN]; }

const NONE = 0xffffffffu;

// The k-th of up to three neighbouring cells along a direction.
fn neighbour(at: u32, k: u32, along: u32) -> u32 {
    let n = P.cells[along];
    if (n < 3u) { return select(NONE, k, k < n); }
    let next = at + k;
    if (next == 0u) { return select(n - 1u, NONE, P.walls[along] != 0u); }
    if (next > n) { return select(0u, NONE, P.walls[along] != 0u); }
    return next - 1u;
}

// The cells along x next to a cell: two ranges [begin, to), the second of which may be empty.
fn ranges(at: u32) -> vec4<u32> {
    let n = P.cells.x;
    if (n < 3u) { return vec4(0u, n, 0u, 0u); }
    if (at == 0u) { return vec4(0u, 2u, select(n - 1u, n, P.walls.x != 0u), n); }
    if (at == n - 1u) { return vec4(n - 2u, n, 0u, select(1u, 0u, P.walls.x != 0u)); }
    return vec4(at - 1u, at + 2u, 0u, 0u);
}

// The vector from b to a, nearest image. Exchange of a and b changes its sign and no bit else.
fn separation(a: vec4<u32>, b: vec4<u32>) -> vec3<f32> {
    let e = bitcast<vec3<i32>>(a.xyz - b.xyz);
    if (!TILTED) { return vec3(P.edge[0].x, P.edge[1].y, P.edge[2].z) * vec3<f32>(e); }
    return P.edge[0].xyz * f32(e.x) + P.edge[1].xyz * f32(e.y) + P.edge[2].xyz * f32(e.z);
}

// ---- noise: Threefry-2x32 with thirteen rounds, as on the CPU

fn turn(x: u32, by: u32) -> u32 { return (x << by) | (x >> (32u - by)); }

fn mix(x: vec2<u32>, by: u32) -> vec2<u32> {
    let y = x.x + x.y;
    return vec2(y, turn(x.y, by) ^ y);
}

fn thirteen_rounds(counter: vec2<u32>, key: vec2<u32>) -> vec2<u32> {
    let third = 0x1BD11BDAu ^ key.x ^ key.y;
    var x = counter + key;
    x = mix(mix(mix(mix(x, 13u), 15u), 26u), 6u) + vec2(key.y, third + 1u);
    x = mix(mix(mix(mix(x, 17u), 29u), 16u), 24u) + vec2(third, key.x + 2u);
    x = mix(mix(mix(mix(x, 13u), 15u), 26u), 6u) + vec2(key.x, key.y + 3u);
    return mix(x, 17u);
}

fn words(a: u32, b: u32) -> vec2<u32> {
    return thirteen_rounds(vec2(min(a, b), max(a, b)), I.key);
}

// Uniform on (−√3, √3).
fn uniform_noise(a: u32, b: u32) -> f32 {
    let centred = f32(bitcast<i32>(words(a, b).x ^ 0x80000000u));
    return (centred + 0.5) * (1.7320508 / 2147483648.0);
}

// The transform of Box and Muller, with the series of the CPU.
fn normal_noise(a: u32, b: u32) -> f32 {
    let w = words(a, b);
    let u = (f32(w.x >> 8u) + 0.5) * (1.0 / 16777216.0);
    let turns = (f32(w.y >> 8u) + 0.5) * (1.0 / 8388608.0) - 1.0;
    let h = 1.5707964 * turns;
    let q = h * h;
    let series = 1.0 - q * (1.0 / 6.0) * (1.0 - q * (1.0 / 20.0) * (1.0 - q * (1.0 / 42.0)
        * (1.0 - q * (1.0 / 72.0) * (1.0 - q * (1.0 / 110.0)))));
    let sine = h * series;
    return sqrt(max(-2.0 * m_ln(u), 0.0)) * (1.0 - 2.0 * sine * sine);
}

// ---- functions of formulas, which drivers compute with different errors

fn m_nan() -> f32 { return bitcast<f32>(P.nan_bits); }
fn m_infinity() -> f32 { return bitcast<f32>(P.nan_bits & 0xff800000u); }
fn m_abs(x: f32) -> f32 { return abs(x); }
fn m_sign(x: f32) -> f32 { return sign(x); }
fn m_sqrt(x: f32) -> f32 { if (x < 0.0) { return m_nan(); } return sqrt(x); }

fn m_select(left: f32, right: f32, then: f32, otherwise: f32) -> f32 {
    if (left <= right) { return then; }
    if (left > right) { return otherwise; }
    return m_nan();
}

// ln x = ln m + e ln 2, with m from √½ to √2 and ln m = 2 artanh s.
fn m_ln(x: f32) -> f32 {
    if (!is_finite(x) || x < 0.0) { return select(m_nan(), x, x > 0.0); }
    if (x < 1.1754944e-38) { return -m_infinity(); }
    let bits = bitcast<i32>(x);
    let e = (bits - 0x3f3504f3) >> 23u;
    let m = bitcast<f32>(bits - (e << 23u));
    let s = (m - 1.0) / (m + 1.0);
    let q = s * s;
    let series = q * (0.33333334 + q * (0.2 + q * (0.14285715 + q * (0.11111111 + q * 0.09090909))));
    // The leading digits of ln 2 times e are exact.
    return f32(e) * 0.693359375 + (2.0 * s + (2.0 * s * series - f32(e) * 2.1219444e-4));
}

// 2^k exp f, with f of at most ½ ln 2.
fn m_exp(x: f32) -> f32 {
    if (x > 88.7) { return m_infinity(); }
    if (x < -87.0) { return 0.0; }
    let k = round(x * 1.442695);
    let f = (x - k * 0.693359375) + k * 2.1219444e-4;
    let p = 1.0 + f * (1.0 + f * (0.5 + f * (0.16666667 + f * (0.041666668 + f * (0.008333334 + f * 0.0013888889)))));
    let half = i32(k) / 2;
    return p * bitcast<f32>((half + 127) << 23u) * bitcast<f32>((i32(k) - half + 127) << 23u);
}

fn m_pow(x: f32, y: f32) -> f32 {
    if (y == 0.0) { return 1.0; }
    if (x > 0.0) { return m_exp(y * m_ln(x)); }
    if (x == 0.0) { return select(m_infinity(), 0.0, y > 0.0); }
    if (y != floor(y)) { return m_nan(); }
    let power = m_exp(y * m_ln(-x));
    return select(power, -power, floor(0.5 * y) != 0.5 * y);
}

// With x = k π/2 + f the function is ± sin f or ± cos f.
fn m_circular(x: f32, shift: i32) -> f32 {
    let k = round(x * 0.63661975);
    let f = ((x - k * 1.5703125) - k * 4.837513e-4) - k * 7.549790e-8;
    let q = f * f;
    let quarter = (i32(k) + shift) & 3;
    let sine = f + f * q * (-0.16666667 + q * (0.008333333 + q * (-1.9841270e-4 + q * 2.7557319e-6)));
    let cosine = 1.0 + q * (-0.5 + q * (0.041666668 + q * (-0.0013888889 + q * (2.4801588e-5 - q * 2.755732e-7))));
    let value = select(sine, cosine, (quarter & 1) != 0);
    return select(value, -value, quarter >= 2);
}
fn m_sin(x: f32) -> f32 { return m_circular(x, 0); }
fn m_cos(x: f32) -> f32 { return m_circular(x, 1); }

fn m_tanh(x: f32) -> f32 {
    let a = abs(x);
    if (a > 9.1) { return sign(x); }
    if (a < 0.3) {
        let q = x * x;
        return x + x * q * (-0.33333334 + q * (0.13333334 + q * (-0.053968254 + q * (0.021869488 - q * 0.008863236))));
    }
    return sign(x) * (1.0 - 2.0 / (m_exp(2.0 * a) + 1.0));
}

// The polynomial piece of a table: row 0 has the number of pieces; each row the knot, the inverse width, and six coefficients
// of powers of the part of the piece. Returns the value, the slope and the second derivative.
fn m_table(begin: u32, x: f32) -> vec3<f32> {
    let pieces = u32(table[begin]);
    var low = 0u;
    var high = pieces;
    while (high - low > 1u) {
        let middle = (low + high) / 2u;
        if (table[begin + 8u + 8u * middle] <= x) { low = middle; } else { high = middle; }
    }
    let at = begin + 8u + 8u * low;
    let inverse = table[at + 1u];
    let t = (x - table[at]) * inverse;
    var value = vec3(0.0);
    for (var k = 7u; k >= 2u; k--) {
        value = vec3(value.x * t + table[at + k], value.y * t + value.x, value.z * t + 2.0 * value.y);
    }
    return vec3(value.x, value.y * inverse, value.z * inverse * inverse);
}

// ---- sums of a workgroup, in the order of a tree

var<workgroup> shared_sums: array<f32, LANES>;

fn sum_of_group(value: f32, lane: u32) -> f32 {
    workgroupBarrier();
    shared_sums[lane] = value;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if (lane < half) { shared_sums[lane] += shared_sums[lane + half]; }
    }
    workgroupBarrier();
    return shared_sums[0];
}

fn store_sum(block: u32, entry: u32, value: f32, lane: u32) {
    let sum = sum_of_group(value, lane);
    // The last row of groups may be longer than needed.
    if (lane == 0u && block < P.blocks) { group_sums[block * ENTRIES + entry] = sum; }
}
