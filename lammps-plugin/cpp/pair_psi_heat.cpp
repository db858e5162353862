// Drag and noise apart from the forces.

#include "pair_psi.h"

#include "compat.h"

#include "atom.h"
#include "domain.h"
#include "force.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace psidpd;

std::string PairPsi::why_not_apart() const
{
  if (!why_listed.empty()) return "pairs come from a neighbor list, because of " + why_listed;
  if (exclusions.rules(neighbor, setflag) > 0) return "neigh_modify excludes pairs from interacting";
  if (!exclusions.pairs_elsewhere(setflag).empty()) return "the hybrid gives pairs of types that this style knows to another style alone";
  const double *factor = force->special_lj;
  if (special.are_scaled(atom, force) && (factor[1] == 0.0 || factor[2] == 0.0 || factor[3] == 0.0))
    return "special_bonds has factors of 0; in DPD bonded atoms interact like all others, with 'special_bonds lj 1 1 1'";
  if (domain->deform_vremap) return "fix deform changes velocities at the edges of the box ('remap v')";
  return {};
}

// Sends vectors from owners to ghosts.
void PairPsi::forward_vectors()
{
  comm_forward = 3;
  exchange.carry(GhostExchange::Carries::vectors, [this] { forward_values(comm, this, 0); });
}

void PairPsi::expect_heat(double time)
{
  refresh();
  attempt([&] { (*style)->expect_thermostat(time); });
}

std::array<double, 6> PairPsi::heat(const std::vector<double> &masses, const Action &action)
{
  refresh();
  const size_t owned = atom->nlocal;
  const int all = atom->nlocal + atom->nghost;
  Heat what;
  what.seed = given.seed;
  what.step = static_cast<uint64_t>(update->ntimestep);
  what.uniform = action.uniform;
  what.time = action.time;
  what.virial = action.wants_virial;
  what.fixed = action.wants_fixed;
  Style &fluid = **style;
  Extent box = extent();
  const Request forces{};
  const bool alone = !strained && is_alone(box) && attempt([&] { return fluid.fits(box, forces); });
  rust::Slice<const bool> flags;
  if (!alone) flags = attempt([&] { return left_out(box, forces); });
  const size_t reach = alone ? owned : all;
  const bool acts = attempt([&] {
    return fluid.thermostat_pairs(box, flags, atoms(reach), {masses.data(), owned}, what);
  });
  if (!acts) return {};
  rust::Slice<double> v;
  if (owned > 0) v = {atom->v[0], 3 * owned};
  const double velocity = fluid.facts().velocity_unit, energy = fluid.facts().energy_unit;
  const auto times = [&](double factor) {
    if (factor != 1.0) std::for_each(v.begin(), v.end(), [=](double &c) { c *= factor; });
  };
  times(1.0 / velocity);
  std::array<double, 6> w{};
  if (alone) {
    w = attempt([&] { return fluid.act_alone(v); });
  } else {
    auto &vectors = exchange.vectors;
    vectors.resize(3 * static_cast<size_t>(all));
    if (owned > 0) std::copy_n(atom->v[0], 3 * owned, vectors.begin());
    forward_vectors();
    const rust::Slice<double> shared{vectors.data(), vectors.size()};
    Round round = attempt([&] { return fluid.thermostat_begin(shared); });
    while (round.wants != Wants::Nothing) {
      std::array<double, 3> totals{};
      if (round.wants == Wants::Totals)
        MPI_Allreduce(round.parts.data(), totals.data(), 3, MPI_DOUBLE, MPI_SUM, world);
      else
        forward_vectors();
      round = attempt([&] { return fluid.thermostat_go_on(totals, shared, v); });
    }
    w = round.virial;
  }
  times(velocity);
  for (double &one : w) one *= energy;
  return w;
}
