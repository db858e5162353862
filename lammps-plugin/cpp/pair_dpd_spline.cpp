/* pair_style dpd/spline T cutoff seed [precision double | mixed] [threads N]
   pair_coeff I J a A B rc1 rc2 gamma

   phi = a [A W(r, rc1) - B W(r, rc2)] with the cubic spline W, W(0) = 1. Drag and noise act within the
   cut-off of pair_style. */

#include "pair_table.h"

#include "atom.h"
#include "domain.h"
#include "lammps.h"

using namespace LAMMPS_NS;

namespace psidpd {

class PairDPDSpline : public PairTable {
 public:
  explicit PairDPDSpline(LAMMPS *lmp) : PairTable(lmp, "dpd/spline", {"a", "A", "B", "rc1", "rc2", "gamma"}) {}

 protected:
  void check(const Coefficients &given) override
  {
    const double rc1 = given.value[3], rc2 = given.value[4], gamma = given.value[5];
    if (!(gamma >= 0.0)) complain("gamma must not be negative, found " + std::to_string(gamma));
    if (rc1 > cutoff || rc2 > cutoff)
      complain("the ranges rc1 = " + std::to_string(rc1) + " and rc2 = " + std::to_string(rc2) +
           " must not exceed the cut-off of pair_style, " + std::to_string(cutoff));
  }

  rust::Box<Style> make_from(double kt, rust::Slice<const Coefficients> pairs) override
  {
    return spline_style(kt, pairs, atom->ntypes, domain->dimension, cutoff);
  }
};

}    // namespace psidpd

extern "C" void *psidpd_create_dpd_spline(void *lmp)
{
  return static_cast<LAMMPS_NS::Pair *>(new psidpd::PairDPDSpline(static_cast<LAMMPS_NS::LAMMPS *>(lmp)));
}
