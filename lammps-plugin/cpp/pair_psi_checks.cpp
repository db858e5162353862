// Checks that the simulation fits the style.

#include "pair_psi.h"

#include "atom.h"
#include "bond.h"
#include "comm.h"
#include "domain.h"
#include "fix.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace psidpd;

namespace {

// Distances between opposite faces of the box.
void heights(const Domain *domain, double *height)
{
  const double *inverse = domain->h_inv;
  height[0] = 1.0 / std::sqrt(inverse[0] * inverse[0] + inverse[5] * inverse[5] + inverse[4] * inverse[4]);
  height[1] = 1.0 / std::sqrt(inverse[1] * inverse[1] + inverse[3] * inverse[3]);
  height[2] = 1.0 / std::fabs(inverse[2]);
}

}    // namespace

// Coefficients are in the units of the simulation. Those in SI units leave the range of single precision.
void PairPsi::check_units(const std::string &units)
{
  if (units != "real" && units != "metal")
    stop("works in units lj, real and metal, found 'units " + units + "'");
}

void PairPsi::check_host()
{
  if (strcmp(update->unit_style, "lj") != 0)
    check_units(update->unit_style);
  if (!atom->tag_enable) stop("needs atom IDs: remove 'atom_modify id no'");
}

bool PairPsi::has_splitting() const
{
  return std::any_of(modify->fix, modify->fix + modify->nfix,
                     [](const Fix *fix) { return strcmp(fix->style, "dpd/splitting") == 0; });
}

bool PairPsi::is_narrow() const
{
  double height[3];
  heights(domain, height);
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && height[k] < 2.0 * (*style)->facts().cutoff) return true;
  return false;
}

// Stops at callers that need energies of single pairs: a many-body energy belongs to particles.
void PairPsi::check_callers()
{
  if ((*style)->facts().slope_width == 0) return;
  for (int k = 0; k < modify->nfix; k++)
    if (strncmp(modify->fix[k]->style, "bond/swap", 9) == 0)
      stop("fix bond/swap decides on the energies of single pairs: it cannot be used with a many-body style");
  for (const char *bond : {"special", "quartic"})
    if (force->bond_match(bond))
      stop(std::string("bond_style ") + bond + " adds or takes away the forces of single pairs: it cannot be used with "
           "a many-body style");
}

// Stops at what only the CPU computes. Exclusions are checked when they are found.
void PairPsi::check_device()
{
  if (!has_device()) return;
  if (!matter.empty()) stop("device gpu computes no walls of fix dpd/wall: use device cpu");
  if (special.are_scaled(atom, force))
    stop("device gpu computes all pairs at full strength: use 'special_bonds lj 1 1 1', or device cpu");
  if (!why_listed.empty())
    stop("device gpu takes no pairs from a neighbor list, which this run needs because of " + why_listed + ": use device cpu");
}

// Two images of one pair would draw the same noise in a box shorter than twice its range.
void PairPsi::check_box()
{
  const double range = (*style)->facts().noise_range;
  double height[3];
  heights(domain, height);
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && height[k] < 2.0 * range)
      stop("the box is " + std::to_string(height[k]) + " long in direction " + "xyz"[k] +
           ", less than twice the range of the thermostat (" + std::to_string(range) +
           "): images of a pair would share their noise; use a longer box");
}

// Stops at atoms off the plane: older versions of LAMMPS fill several planes with a lattice.
void PairPsi::check_plane()
{
  if (domain->dimension != 2) return;
  double mine[2] = {-1e300, -1e300}, all[2];
  for (int i = 0; i < atom->nlocal; i++) {
    const double z = atom->x[i][2];
    mine[0] = std::max(mine[0], z);
    mine[1] = std::max(mine[1], -z);
  }
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_MAX, world);
  if (all[0] + all[1] > 1e-6 * (*style)->facts().cutoff)
    stop("in two dimensions all atoms must have the same z, found " + std::to_string(-all[1]) + " to " +
         std::to_string(all[0]) + ": use a box that is thinner than the lattice, or 'set group all z 0'");
}

void PairPsi::check_ghosts()
{
  if (comm->mode != Comm::SINGLE) return;
  const double cutoff = (*style)->facts().cutoff;
  double height[3] = {1.0, 1.0, 1.0};
  // In a triclinic box LAMMPS gives lengths as fractions of the box.
  if (domain->triclinic) heights(domain, height);
  for (int k = 0; k < domain->dimension; k++) {
    const double reach = comm->cutghost[k] * height[k];
    if (reach < cutoff * (1.0 - 1e-12))
      stop("ghost atoms reach " + std::to_string(reach) + ", the cut-off is " + std::to_string(cutoff) +
           ": raise it with 'comm_modify cutoff'");
  }
}

// Warns of fixes with a temperature: drag and noise keep one already.
void PairPsi::check_thermostats()
{
  if (!(*style)->facts().needs_velocities || update->whichflag == 2) return;
  for (int k = 0; k < modify->nfix; k++) {
    Fix *fix = modify->fix[k];
    int dimension = 0;
    if (!fix->extract("t_target", dimension) || !named.insert(fix->id).second) continue;
    warn(std::string("fix ") + fix->id + " (" + fix->style +
         ") is a second thermostat beside drag and noise, which keep the temperature alone: use fix nve" +
         (fix->time_integrate ? "" : " without it") + ", or gamma 0");
  }
}

void PairPsi::displace(bool away)
{
  if (away && neighbor->ago == 0) ghost_reach.begin(atom);
  displaced = away;
}

// Stops where LAMMPS's ghosts, or the lists that it makes of them, would lack atoms: LAMMPS itself does not look then.
void PairPsi::check_reach(bool alone)
{
  const bool lists = neighbor->nlist > 0;
  if (neighbor->dist_check || (alone && !lists)) return;
  const std::string text = ghost_reach.lost(atom, neighbor);
  if (text.empty()) return;
  stop_here(text + "; " +
            (alone ? std::string("this style needs no ghosts on one rank, but a compute, a fix or another style has asked for "
                                 "neighbor lists, which would lack pairs")
                   : std::string("pairs would be left out")) +
            ": use 'neigh_modify delay 0 every 1 check yes', or a wider skin (command 'neighbor')");
}

// 'thermo_modify lost' decides whether LAMMPS stops or continues; a style cannot read it.
void PairPsi::check_lost()
{
  const std::string text = lost_atoms.missing(atom, world);
  if (!text.empty())
    warn("at step " + std::to_string(update->ntimestep) + " " + text +
         ": they went past all neighboring ranks, or out of a box that is not periodic, between two builds of lists; a "
         "shorter timestep and 'neigh_modify every 1' help in the first case");
}
