// Atoms whose force other fixes set.
//
// Such a fix replaces drag and noise too where these are forces. Here they are not, so it is given a probe of forces: where
// it changes them it sets them, and drag and noise must not move the atom. What it then reports as the force that was there is
// made the mean force of the timestep, and of drag and noise since they last acted: so the mean of reports is the momentum that
// other atoms lost.

#include "fix_splitting.h"

#include "pair_psi.h"

#include "atom.h"
#include "domain.h"
#include "error.h"
#include "modify.h"
#include "update.h"

#include <algorithm>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace psidpd;

namespace {

bool begins_with_one_of(const char *style, std::initializer_list<const char *> names)
{
  return std::any_of(names.begin(), names.end(), [=](const char *name) { return !strncmp(style, name, strlen(name)); });
}

// Fixes that set forces to a value of their own.
bool sets_forces(const char *style) { return begins_with_one_of(style, {"setforce", "freeze"}); }

// Fixes that take components out of forces, or average them.
bool takes_from_forces(const char *style)
{
  return begins_with_one_of(style, {"lineforce", "planeforce", "aveforce", "manifoldforce", "flow/gauss"});
}

}    // namespace

void FixSplitting::pre_force(int)
{
  held.assign(atom->nlocal, 0);
  has_setters = false;
  for (int k = 0; k < modify->nfix; k++) {
    Fix *fix = modify->fix[k];
    if (!(modify->fmask[k] & POST_FORCE)) continue;
    has_setters = has_setters || sets_forces(fix->style);
    if (sets_forces(fix->style) || takes_from_forces(fix->style)) find_held(fix);
  }
}

void FixSplitting::find_held(Fix *fix)
{
  const int owned = atom->nlocal, dimension = domain->dimension;
  const auto is_touched = [=](int i) { return (atom->mask[i] & fix->groupbit) != 0; };
  // No force that is set, and different for each atom, as averages keep equal forces.
  const auto probe = [=](int i, int c) { return 0.731058578630005 + 0.0123 * c + 1.7e-3 * (atom->tag[i] & 1023); };
  covered.clear();
  for (int i = 0; i < owned; i++) {
    if (!is_touched(i)) continue;
    double *f = atom->f[i];
    covered.insert(covered.end(), f, f + 3);
    for (int c = 0; c < dimension; c++) f[c] = probe(i, c);
  }
  fix->post_force(0);
  const double *before = covered.data();
  const uint8_t whole = dimension == 2 ? 3 : 7;
  bool is_part = false;
  for (int i = 0; i < owned; i++) {
    if (!is_touched(i)) continue;
    double *f = atom->f[i];
    uint8_t changed = 0;
    for (int c = 0; c < dimension; c++)
      if (f[c] != probe(i, c)) changed |= 1 << c;
    std::copy_n(before, 3, f);
    before += 3;
    if (sets_forces(fix->style)) held[i] |= changed;
    if ((atom->mask[i] & groupbit) && changed && (changed != whole || !sets_forces(fix->style))) is_part = true;
  }
  if (is_part)
    error->one(FLERR, std::string("Fix ") + style + ": fix " + fix->id + " (" + fix->style +
                          ") changes a part of the forces on atoms, and drag and noise would bypass it: hold atoms by 'fix setforce 0 0 0' "
                          "in all directions, leave them out of the group, or use fix nve");
}

void FixSplitting::setup_pre_reverse(int eflag, int vflag)
{
  vflag_of_step = vflag;
  evaluation = Evaluation::other;
  warned = false;
  too_stiff.clear();
  rehearse();
  pre_reverse(eflag, vflag);
}

// The velocities stay as they are.
void FixSplitting::rehearse()
{
  if (!pair || update->whichflag != 1 || !(update->dt > 0.0) || !(wants_virial() || has_setters)) return;
  const size_t count = 3 * static_cast<size_t>(atom->nlocal);
  double *v = count > 0 ? atom->v[0] : nullptr;
  const std::vector<double> present(v, v + count);
  act();
  std::copy(present.begin(), present.end(), v);
}

void FixSplitting::pre_reverse(int, int)
{
  if (!has_setters) return;
  for (int i = 0; i < atom->nlocal; i++)
    for (int c = 0; c < 3; c++)
      if (held[i] >> c & 1) {
        double &f = atom->f[i][c], &middle = pushes[i][3 + c];
        if (evaluation == Evaluation::middle) middle = (1.0 - share_of_end()) * f;
        if (evaluation == Evaluation::end) f = share_of_end() * f + middle;
        f += pushes[i][c];
      }
}

void FixSplitting::keep_pushes()
{
  const auto force = pair->engine().forces_on_fixed();
  const double unit = pair->engine().facts().force_unit;
  const bool acts = !force.empty();
  for (int i = 0; i < atom->nlocal; i++)
    for (int c = 0; c < 3; c++) pushes[i][c] = acts && held[i] ? unit * force[3 * static_cast<size_t>(i) + c] : 0.0;
}
