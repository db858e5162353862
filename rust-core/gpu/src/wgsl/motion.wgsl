// Kick and drift, and the sort by cells that follows.

// How long it takes to a face at a distance, and the speed there, with the speed `towards` it and the acceleration `away` from
// it; a negative time if it is never met.
fn meet(distance: f32, towards: f32, away: f32) -> vec2<f32> {
    let square = towards * towards - 2.0 * away * distance;
    if (!(square >= 0.0)) { return vec2(-1.0, 0.0); }
    let speed = sqrt(square);
    if (towards > 0.0) { return vec2(2.0 * distance / (towards + speed), speed); }
    if (away < 0.0) { return vec2((speed - towards) / -away, speed); }
    return vec2(-1.0, 0.0);
}

// Distances from both faces at the end of a path, and the velocity that the faces have given.
struct Flight { below: f32, above: f32, given: f32, is_over: bool }

// The path of a particle between two faces under a constant acceleration, as `bounce.rs` of the host has it.
fn fly(start: vec2<f32>, velocity: f32, a: f32, time: f32) -> Flight {
    let width = start.x + start.y;
    var at = start;
    var u = velocity;
    var left = time;
    var given = 0.0;
    for (var n = 0u; n < 16u; n++) {
        let low = meet(at.x, -u, a);
        let high = meet(at.y, u, -a);
        let is_low = low.x >= 0.0 && !(high.x >= 0.0 && high.x < low.x);
        let met = select(high, low, is_low);
        if (!(met.x >= 0.0 && met.x < left)) {
            let by = left * (u + 0.5 * left * a);
            return Flight(at.x + by, at.y - by, given, true);
        }
        let speed = met.y;
        let away = select(-1.0, 1.0, is_low);
        left -= met.x;
        u = away * speed;
        given += 2.0 * u;
        at = select(vec2(width, 0.0), vec2(0.0, width), is_low);
        let presses = -away * a;
        if (presses > 0.0 && speed * speed <= 2.0 * presses * width) {
            // It comes back to this face again and again, or rests there.
            if (presses * left >= 2e6 * speed) {
                return Flight(at.x, at.y, given + away * presses * left, true);
            }
            let period = 2.0 * speed / presses;
            let hops = floor(left / period);
            left = clamp(left - hops * period, 0.0, period);
            let by = away * max(left * (speed - 0.5 * presses * left), 0.0);
            return Flight(at.x + by, at.y - by, given + 2.0 * hops * u, true);
        }
    }
    return Flight(0.0, 0.0, 0.0, false);
}

// v += a F/m (twice if the last kick of the step before was deferred); x += b v. Counts the particles of each cell. Particles
// that meet a face move on the path under the present force, from the velocity v − c F/m and the place x − d F/m.
@KERNEL kick_drift {
    if (halted() || i >= P.count) { return; }
    var v = vel[i];
    var s = pos[i];
    var boxes = box_of[i];
    // The same operation as in `kick`, so that a deferred kick has its bits.
    let by_force = vec3(I.a * inverse_mass(v));
    let f = force[i].xyz;
    var u = fma(by_force, f, v.xyz);
    if ((I.flags & FLAG_DEFERRED) != 0u) { u = fma(by_force, f, u); }
    if (!all_finite(u)) {
        atomicMin(&status.velocity, s.w);
        fail();
        return;
    }
    let way = I.b * u;
    for (var k = 0u; k < D; k++) {
        let move_by = dot(P.row[k].xyz, way);
        if (!(abs(move_by) < 2147483000.0)) {
            atomicMin(&status.runaway, s.w);
            fail();
            return;
        }
        let by = i32(round(move_by));
        let to = s[k] + bitcast<u32>(by);
        if (P.walls[k] != 0u) {
            // Coordinates between walls have 31 bits.
            let is_outside = (to & 0x80000000u) != 0u;
            let unit = P.edge[k][k];
            let a = inverse_mass(v) * f[k];
            var start = vec2(f32(s[k]), f32(0x80000000u - s[k])) * unit + vec2(-I.d * a, I.d * a);
            start = max(start, vec2(0.0));
            let path = u[k] - I.c * a;
            // A parabola is within the triangle of its ends and of the point where their tangents meet.
            let middle = 0.5 * I.b * path;
            let end = I.b * (path + 0.5 * I.b * a);
            if (!is_outside && start.x + min(middle, end) >= 0.0 && start.y - max(middle, end) >= 0.0) {
                s[k] = to;
                continue;
            }
            let flight = fly(start, path, a, I.b);
            if (!flight.is_over) {
                atomicMin(&status.runaway, s.w);
                fail();
                return;
            }
            if (!is_outside && flight.given == 0.0) {
                s[k] = to;
                continue;
            }
            u[k] += flight.given;
            let shift = (I.d + (I.c - 0.5 * I.b) * I.b) * a;
            let below = max(flight.below + shift, 0.0) / unit;
            let above = max(flight.above - shift, 0.0) / unit;
            if (below < above) {
                s[k] = min(u32(round(below)), 0x7fffffffu);
            } else {
                s[k] = 0x80000000u - clamp(u32(round(above)), 1u, 0x80000000u);
            }
        } else {
            boxes[k] += select(0, 1, by > 0 && to < s[k]) - select(0, 1, by < 0 && to > s[k]);
            s[k] = to;
        }
    }
    pos[i] = s;
    vel[i] = vec4(u, v.w);
    box_of[i] = boxes;
    let cell = cell_index(cell_of(s));
    slots[i].x = atomicAdd(&counts[cell], 1u);
}

// Counts the particles of each cell, where none moves, and numbers them as the host does.
@KERNEL count_cells {
    if (halted() || i >= P.count) { return; }
    box_of[i].w = i32(i);
    slots[i].x = atomicAdd(&counts[cell_index(cell_of(pos[i]))], 1u);
}

// Puts particles at x + a F/m for an evaluation of forces, mirrored at faces.
@KERNEL displace {
    if (halted() || i >= P.count) { return; }
    var s = pos[i];
    kept[i] = s;
    let way = (I.a * inverse_mass(vel[i])) * force[i].xyz;
    for (var k = 0u; k < D; k++) {
        let move_by = dot(P.row[k].xyz, way);
        if (!(abs(move_by) < 2147483000.0)) {
            atomicMin(&status.runaway, s.w);
            fail();
            return;
        }
        let to = s[k] + bitcast<u32>(i32(round(move_by)));
        let is_outside = P.walls[k] != 0u && (to & 0x80000000u) != 0u;
        s[k] = select(to, min(0u - to, 0x7fffffffu), is_outside);
    }
    pos[i] = s;
    slots[i].x = atomicAdd(&counts[cell_index(cell_of(s))], 1u);
}

// Puts particles back, which have been sorted since.
@KERNEL step_back {
    if (halted() || i >= P.count) { return; }
    pos[i] = kept[slots[i].x];
}

// v += a F/m.
@KERNEL kick {
    if (halted() || i >= P.count) { return; }
    let v = vel[i];
    let u = fma(vec3(I.a * inverse_mass(v)), force[i].xyz, v.xyz);
    if (!all_finite(u)) {
        atomicMin(&status.velocity, pos[i].w);
        fail();
    }
    vel[i] = vec4(u, v.w);
}

var<workgroup> shared_counts: array<u32, LANES>;

// Exclusive sum within a workgroup; `shared_counts[LANES − 1]` is the total afterwards.
fn scan_group(value: u32, lane: u32) -> u32 {
    workgroupBarrier();
    shared_counts[lane] = value;
    for (var by = 1u; by < LANES; by *= 2u) {
        workgroupBarrier();
        var below = 0u;
        if (lane >= by) { below = shared_counts[lane - by]; }
        workgroupBarrier();
        shared_counts[lane] += below;
    }
    workgroupBarrier();
    return shared_counts[lane] - value;
}

// Sums the counts of SCAN cells, and clears them for the next sort.
@KERNEL scan_cells {
    let begin = block * SCAN + lane * (SCAN / LANES);
    var local: array<u32, SCAN / LANES>;
    var total = 0u;
    // A failed step keeps its order, with which it may go on.
    let length = select(arrayLength(&counts), 0u, halted());
    for (var k = 0u; k < SCAN / LANES; k++) {
        local[k] = total;
        if (begin + k < length) {
            total += atomicLoad(&counts[begin + k]);
            atomicStore(&counts[begin + k], 0u);
        }
    }
    let before = scan_group(total, lane);
    for (var k = 0u; k < SCAN / LANES; k++) {
        if (begin + k < length) { starts[begin + k] = before + local[k]; }
    }
    if (lane == 0u && block < arrayLength(&sums) && length > 0u) { sums[block] = shared_counts[LANES - 1u]; }
}

// Sums the sums, with one workgroup.
@KERNEL scan_sums {
    let length = arrayLength(&sums);
    let writes = !halted();
    var carry = 0u;
    for (var begin = 0u; begin < length; begin += LANES) {
        let k = begin + lane;
        var value = 0u;
        if (k < length) { value = sums[k]; }
        let before = scan_group(value, lane);
        if (k < length && writes) { sums[k] = carry + before; }
        carry += shared_counts[LANES - 1u];
    }
}

// Lists the particles of each cell, in an order that depends on the run.
@KERNEL list_cells {
    if (halted() || i >= P.count) { return; }
    slots[first_of(cell_index(cell_of(pos[i]))) + slots[i].x].y = i;
}

// Moves each particle to its place: by cell, and within a cell by tag; images of one particle share a tag.
@KERNEL sort {
    if (halted() || i >= P.count) { return; }
    let own = pos[i];
    let cell = cell_index(cell_of(own));
    let begin = first_of(cell);
    let to = first_of(cell + 1u);
    var place = begin;
    for (var k = begin; k < to; k++) {
        let other = slots[k].y;
        let tag = pos[other].w;
        if (tag < own.w || (tag == own.w && other < i)) { place += 1u; }
    }
    slots[place].x = i;
    sorted_pos[place] = own;
    sorted_vel[place] = vel[i];
    sorted_box[place] = box_of[i];
}

// Momentum and its flux, and the force on frozen particles.
@KERNEL measure {
    var v = vec3(0.0);
    var m = 0.0;
    var support = vec3(0.0);
    if (i < P.count) {
        v = vel[i].xyz;
        m = mass_of(vel[i]);
        if (is_frozen(vel[i])) { support = force[i].xyz; }
    }
    store_sum(block, 14u, m * v.x * v.x, lane);
    store_sum(block, 15u, m * v.y * v.y, lane);
    store_sum(block, 16u, m * v.z * v.z, lane);
    store_sum(block, 17u, m * v.x * v.y, lane);
    store_sum(block, 18u, m * v.x * v.z, lane);
    store_sum(block, 19u, m * v.y * v.z, lane);
    for (var k = 0u; k < 3u; k++) {
        store_sum(block, 20u + k, m * v[k], lane);
        store_sum(block, 23u + k, support[k], lane);
    }
}
