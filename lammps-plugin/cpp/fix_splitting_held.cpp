// Atoms whose force other fixes set.
//
// Such a fix replaces drag and noise too where these are forces. Here they are not, so it is asked for two sets of forces
// what it makes of them: where the difference is gone the atom is held.

#include "fix_splitting.h"

#include "atom.h"
#include "domain.h"
#include "modify.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace psidpd;

namespace {

// Fixes that set forces, or take components out of them.
bool replaces_forces(const char *style)
{
  for (const char *known :
       {"setforce", "freeze", "lineforce", "planeforce", "aveforce", "manifoldforce", "flow/gauss"})
    if (strncmp(style, known, strlen(known)) == 0) return true;
  return false;
}

}    // namespace

void FixSplitting::pre_force(int)
{
  const int owned = atom->nlocal;
  held.assign(owned, 0);
  for (int k = 0; k < modify->nfix; k++) {
    Fix *fix = modify->fix[k];
    if (!(modify->fmask[k] & POST_FORCE) || !replaces_forces(fix->style)) continue;
    const auto none = replaced(fix, 0.0), probe = replaced(nullptr, 1.0), found = replaced(fix, 1.0);
    int is_part = 0;
    for (int i = 0; i < owned; i++) {
      if (!(atom->mask[i] & groupbit)) continue;
      bool gone = true, kept = true;
      for (size_t c = 3 * static_cast<size_t>(i); c < 3 * static_cast<size_t>(i) + 3; c++) {
        const double left = found[c] - none[c];
        gone = gone && left == 0.0;
        kept = kept && std::fabs(left - probe[c]) <= 1e-6 * std::fabs(probe[c]);
      }
      if (gone) held[i] = 1;
      if (!gone && !kept) is_part = 1;
    }
    int any = 0;
    MPI_Allreduce(&is_part, &any, 1, MPI_INT, MPI_MAX, world);
    if (any)
      stop(std::string("fix ") + fix->id + " (" + fix->style +
           ") changes a part of the forces on atoms, and drag and noise would bypass it: hold atoms by 'fix setforce 0 0 0' "
           "in all directions, leave them out of the group, or use fix nve");
  }
}

std::vector<double> FixSplitting::replaced(Fix *fix, double scale)
{
  const size_t count = 3 * static_cast<size_t>(atom->nlocal);
  double *f = count > 0 ? atom->f[0] : nullptr;
  const std::vector<double> before(f, f + count);
  for (int i = 0; i < atom->nlocal; i++)
    for (int c = 0; c < 3; c++)
      // Different for each atom and direction: an average or a projection changes them.
      f[3 * i + c] = c == 2 && domain->dimension == 2 ? 0.0 : scale * (1.5 + std::sin(atom->tag[i] + 2.0 * c));
  if (fix) fix->post_force(0);
  std::vector<double> after(f, f + count);
  std::copy(before.begin(), before.end(), f);
  return after;
}
