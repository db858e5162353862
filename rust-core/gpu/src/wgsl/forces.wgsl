// The two passes over pairs: local densities with ψ and its slopes, and forces.

// Densities of a particle, ψ, and ∂ψ/∂n.
@KERNEL densities {
    let acts = is_owned(i);
    var psi = 0.0;
    if (acts) {
        let own = pos[i];
        let species = species_of(vel[i]);
        var n: array<f32, V>;
        @NEIGHBOURS(DENSITY_RANGE2)
            let r = sqrt(r2);
            @ADD_WEIGHTS
        @END
        let excess = excess_of(species, n);
        psi = excess.psi;
        var finite = is_finite(psi);
        for (var k = 0u; k < V; k++) {
            slopes[i * V + k] = excess.slope[k];
            finite = finite && is_finite(excess.slope[k]);
        }
        if (!finite) {
            atomicMin(&status.excess, own.w);
            fail();
        }
        if (excess.below) { atomicAdd(&status.below, 1u); }
        if (excess.above) { atomicAdd(&status.above, 1u); }
    }
    if (TOTALS) { store_sum(block, 0u, psi, lane); }
}

// Conservative forces, and with FLAG_NOISE drag and noise: a is √(2kT/Δt).
@KERNEL forces {
    let acts = is_owned(i);
    var sum = vec3(0.0);
    var energy = 0.0;
    var virial: array<f32, 6>;
    var of_thermostat: array<f32, 6>;
    if (acts) {
        let own = pos[i];
        let v = vel[i];
        let species = species_of(v);
        @NEIGHBOURS(RANGE2)
            let r = sqrt(r2);
            let inverse = select(0.0, 1.0 / r, r2 > 0.0);
            let e = d * inverse;
            let other = vel[j];
            let of_other = species_of(other);
            // φ and its slope, with those of the densities.
            let pair = pair_terms(species, of_other, r);
            var along = -(pair.y + @MANY_BODY);
            if (TOTALS) {
                energy += 0.5 * pair.x;
                add_virial(&virial, e, 0.5 * r * along);
            }
            if ((I.flags & FLAG_NOISE) != 0u) {
                let w = drag_weight(species, of_other, r);
                if (w > 0.0) {
                    let heat = w * (I.a * uniform_noise(own.w, at.w) - w * dot(e, v.xyz - other.xyz));
                    along += heat;
                    if (TOTALS) { add_virial(&of_thermostat, e, 0.5 * r * heat); }
                }
            }
            sum += e * along;
        @END
        let marks = marks_of(v) >> 1u;
        for (var k = 0u; k < P.body_forces; k++) {
            if ((marks & (1u << k)) != 0u) {
                let body = P.body[k];
                let along = u32(body.w);
                let reversed = along < 3u && (own[min(along, 2u)] >> (31u - P.walls[min(along, 2u)])) != 0u;
                sum += select(body.xyz, -body.xyz, reversed) * mass_of(v);
            }
        }
        if (!all_finite(sum)) {
            atomicMin(&status.force, own.w);
            fail();
        }
        force[i] = vec4(sum, 0.0);
    }
    if (TOTALS) {
        store_sum(block, 1u, energy, lane);
        for (var k = 0u; k < 6u; k++) {
            store_sum(block, 2u + k, virial[k], lane);
            store_sum(block, 8u + k, of_thermostat[k], lane);
        }
    }
}

fn add_virial(to: ptr<function, array<f32, 6>>, e: vec3<f32>, factor: f32) {
    let f = factor * e;
    (*to)[0] += f.x * e.x;
    (*to)[1] += f.y * e.y;
    (*to)[2] += f.z * e.z;
    (*to)[3] += f.x * e.y;
    (*to)[4] += f.x * e.z;
    (*to)[5] += f.y * e.z;
}

// Where the host keeps the particles: slopes of its own, slopes of its ghosts, and forces.
@KERNEL give_slopes {
    if (!is_owned(i)) { return; }
    for (var k = 0u; k < V; k++) { exchange[u32(box_of[i].w) * V + k] = slopes[i * V + k]; }
}

@KERNEL take_slopes {
    if (halted() || i >= P.count || !is_ghost(vel[i])) { return; }
    for (var k = 0u; k < V; k++) { slopes[i * V + k] = exchange[u32(box_of[i].w) * V + k]; }
}

@KERNEL give_forces {
    if (!is_owned(i)) { return; }
    for (var k = 0u; k < 3u; k++) { exchange[u32(box_of[i].w) * 3u + k] = force[i][k]; }
}
