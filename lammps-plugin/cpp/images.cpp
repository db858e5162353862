#include "images.h"

#include "atom.h"
#include "domain.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace psidpd;

namespace {

// Number of images that are watched on each side.
constexpr int SAMPLE = 4;

}    // namespace

void Images::begin(const std::array<bool, 3> &closed, int owned, int ghosts)
{
  along = closed;
  told = ghosts;
  this->owned = owned;
  watched.clear();
  packed.clear();
  if (ghosts > room || !image) {
    room = ghosts + ghosts / 8 + 1;
    image.reset(new bool[room]);
  }
  std::fill_n(image.get(), ghosts, false);
}

void Images::pack(int n, const int *list, double *buf, int pbc_flag, const int *pbc)
{
  bool crosses = false;
  for (int k = 0; k < 3; k++) crosses |= pbc_flag && along[k] && pbc[k] != 0;
  for (int i = 0; i < n; i++) buf[i] = crosses || (list[i] >= owned && image[list[i] - owned]);
  packed.clear();
  if (!crosses || n == 0) return;
  std::array<int, 6> periods;
  std::copy_n(pbc, 6, periods.begin());
  for (int k = 0; k < SAMPLE; k++) {
    const int at = static_cast<int>((n - 1LL) * k / (SAMPLE - 1));
    packed.push_back({at, list[at], periods});
  }
}

void Images::unpack(int n, int first, const double *buf)
{
  for (int i = 0; i < n; i++) image[first + i - owned] = buf[i] != 0.0;
  for (auto &one : packed) {
    one.ghost += first;
    watched.push_back(one);
  }
  packed.clear();
}

bool Images::have_moved(const Atom *atom, const Domain *domain) const
{
  const double *h = domain->h;
  const double near = 1e-12 * (h[0] + h[1] + h[2]);
  for (const auto &one : watched) {
    const auto &p = one.periods;
    const double *ghost = atom->x[one.ghost], *of = atom->x[one.of];
    const double apart[3] = {p[0] * h[0] + p[5] * h[5] + p[4] * h[4], p[1] * h[1] + p[3] * h[3], p[2] * h[2]};
    // A distance that is not a number counts as moved.
    for (int k = 0; k < 3; k++)
      if (!(std::fabs(ghost[k] - of[k] - apart[k]) <= near)) return true;
  }
  return false;
}
