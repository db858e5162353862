// The implicit midpoint rule over all pairs, by conjugate gradients as on the CPU. With a = √(½Δt) a pair has the vector
// g = a √γ w_R ê; b is √kT.

// The residual √kT Σ ξ g − K v, and the first direction.
@KERNEL heat_start {
    var square = 0.0;
    if (!halted() && i < P.count) {
        let own = pos[i];
        let v = vel[i];
        let species = species_of(v);
        var sum = vec3(0.0);
        @NEIGHBOURS(DRAG_RANGE2)
            let other = vel[j];
            let g = drag_vector(species, species_of(other), d, r2);
            sum += g * (I.b * normal_noise(own.w, at.w) - dot(g, v.xyz - other.xyz));
        @END
        let first = inverse_mass(v) * sum;
        residual[i] = vec4(sum, 0.0);
        solution[i] = vec4(0.0);
        direction[i] = vec4(first, 0.0);
        square = dot(first, sum);
        if (i == 0u) {
            status.state = 0u;
            status.iterations = 0u;
        }
    }
    store_sum(block, 27u, square, lane);
}

fn drag_vector(a: u32, b: u32, d: vec3<f32>, r2: f32) -> vec3<f32> {
    let r = sqrt(r2);
    return d * select(0.0, I.a * drag_weight(a, b, r) / r, r2 > 0.0);
}

// The image (M + K) p of the direction.
@KERNEL heat_image {
    var curvature = 0.0;
    var square = 0.0;
    if (!halted() && status.state == 0u && i < P.count) {
        let own = pos[i];
        let v = vel[i];
        let species = species_of(v);
        let p = direction[i].xyz;
        var sum = vec3(0.0);
        @NEIGHBOURS(DRAG_RANGE2)
            let g = drag_vector(species, species_of(vel[j]), d, r2);
            sum += g * dot(g, p - direction[j].xyz);
        @END
        if (!is_frozen(v)) {
            sum += mass_of(v) * p;
            curvature = dot(p, sum);
            square = inverse_mass(v) * dot(sum, sum);
        }
        image[i] = vec4(sum, 0.0);
    }
    store_sum(block, 28u, curvature, lane);
    store_sum(block, 29u, square, lane);
}

// Sums three entries of all blocks in a fixed order.
fn sum_of_blocks(entry: u32, lane: u32) -> vec3<f32> {
    var own = vec3(0.0);
    for (var block = lane; block < P.blocks; block += LANES) {
        let at = block * ENTRIES + entry;
        own += vec3(group_sums[at], group_sums[at + 1u], group_sums[at + 2u]);
    }
    return vec3(sum_of_group(own.x, lane), sum_of_group(own.y, lane), sum_of_group(own.z, lane));
}

// Decides how far to go along the direction. c is the tolerance, d the least relative residual.
@KERNEL heat_decide {
    // r·M⁻¹r of the first residual, p·Ap and Ap·M⁻¹Ap.
    let found = sum_of_blocks(27u, lane);
    if (lane != 0u || halted()) { return; }
    if (status.state != 0u) {
        status.state = 2u;
        return;
    }
    if (status.iterations == 0u) {
        status.drag = max(sqrt(found.z / found.x) - 1.0, 1.0);
        status.first = found.x;
        status.now = found.x;
        status.residual = 1.0;
        status.direction = 1.0;
    }
    status.iterations += 1u;
    status.alpha = 0.0;
    if (found.y > 0.0) { status.alpha = status.now / found.y; }
}

// Moves along the direction.
@KERNEL heat_advance {
    var square = 0.0;
    if (!halted() && status.state == 0u && i < P.count) {
        let rest = residual[i].xyz - status.alpha * image[i].xyz;
        solution[i] += status.alpha * direction[i];
        residual[i] = vec4(rest, 0.0);
        square = inverse_mass(vel[i]) * dot(rest, rest);
    }
    store_sum(block, 30u, square, lane);
}

// Decides whether to go on. The norm is that of the residual itself: in single precision the recurrence of the CPU,
// α² Ap·M⁻¹Ap − r·M⁻¹r, loses its digits under strong drag.
@KERNEL heat_judge {
    let next = sum_of_blocks(30u, lane).x;
    if (lane != 0u || halted() || status.state != 0u) { return; }
    status.beta = next / status.now;
    status.now = next;
    status.residual -= status.alpha * status.direction;
    status.direction = status.residual + status.beta * status.direction;
    let wanted = I.c / status.drag;
    let accurate = wanted >= I.d && is_below(wanted) && (adds_residual() || abs(status.residual) <= 1e-2);
    if (!accurate && !is_below(I.d) && is_finite(next) && status.iterations < 500u) { return; }
    status.state = 1u;
    status.updates += 1u;
    status.total_iterations += status.iterations;
    if (!accurate) { status.inaccurate += 1u; }
}

fn is_below(relative: f32) -> bool { return status.now <= relative * relative * status.first; }

// Whether the last residual is added to the solution: under strong drag it would become larger.
fn adds_residual() -> bool { return status.drag < 2.0; }

// Computes the next direction. After the last iteration it is the whole change to the midpoint, and the solution has the
// residual added.
@KERNEL heat_turn {
    if (halted() || status.state == 2u || i >= P.count) { return; }
    let inverse = inverse_mass(vel[i]);
    if (status.state == 0u) {
        direction[i] = status.beta * direction[i] + inverse * residual[i];
    } else {
        let at = solution[i];
        direction[i] = at;
        solution[i] = at + select(0.0, inverse, adds_residual()) * residual[i];
    }
}

// The virial of the impulses over Δt: drag at the midpoint, and noise. c is 2/Δt.
@KERNEL heat_virial {
    var virial: array<f32, 6>;
    if (!halted() && i < P.count) {
        let own = pos[i];
        let v = vel[i];
        let middle = v.xyz + direction[i].xyz;
        let species = species_of(v);
        @NEIGHBOURS(DRAG_RANGE2)
            let other = vel[j];
            let g = drag_vector(species, species_of(other), d, r2);
            let along = I.b * normal_noise(own.w, at.w) - dot(g, middle - other.xyz - direction[j].xyz);
            let size = sqrt(dot(g, g));
            if (size > 0.0) { add_virial(&virial, g / size, 0.5 * I.c * sqrt(r2) * size * along); }
        @END
    }
    for (var k = 0u; k < 6u; k++) { store_sum(block, 8u + k, virial[k], lane); }
}

// v += 2 δ. Fails if conjugate gradients need more iterations.
@KERNEL heat_apply {
    if (halted() || i >= P.count) { return; }
    if (status.state == 0u) {
        if (i == 0u) {
            atomicStore(&status.unfinished, 1u);
            fail();
        }
        return;
    }
    let v = vel[i];
    // A frozen particle has no direction.
    let u = v.xyz + 2.0 * solution[i].xyz;
    if (!all_finite(u)) {
        atomicMin(&status.velocity, pos[i].w);
        fail();
    }
    vel[i] = vec4(u, v.w);
}
