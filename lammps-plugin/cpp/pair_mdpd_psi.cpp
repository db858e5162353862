/* pair_style mdpd/psi T cutoff seed [law conservative | lucy] [precision double | mixed] [threads N]
   pair_coeff I J A B gamma rc rd [rt [exponent]]

   The coefficients of the built-in mdpd. 'law lucy' computes the built-in's own force, which has no
   potential; the default is the conservative force of the quadratic kernel. */

#include "pair_table.h"

#include "atom.h"
#include "domain.h"
#include "lammps.h"

#include <cstring>

using namespace LAMMPS_NS;

namespace psidpd {

class PairMDPDPsi : public PairTable {
 public:
  explicit PairMDPDPsi(LAMMPS *lmp) : PairTable(lmp, "mdpd/psi", {"A", "B", "gamma", "rc", "rd", "rt", "exponent"}, 2) {}

 protected:
  void read_settings(int narg, char **arg) override
  {
    lucy = false;
    PairTable::read_settings(narg, arg);
  }

  bool read_keyword(const std::string &key, const std::string &value) override
  {
    if (key != "law") return false;
    lucy = value == "lucy";
    if (!lucy && value != "conservative")
      stop("unknown law '" + value + "': expected 'conservative' or 'lucy'");
    return true;
  }

  std::string keywords() const override { return "'law', 'precision', 'threads' or 'device'"; }

  void check(const Coefficients &given) override
  {
    const double gamma = given.value[2], rc = given.value[3], rd = given.value[4], rt = given.value[5], exponent = given.value[6];
    if (!(gamma >= 0.0)) complain("gamma must not be negative, found " + std::to_string(gamma));
    // 0 stands for rc, and for an exponent of 1.
    if (!(rt >= 0.0)) complain("rt, the range of drag and noise, must not be negative, found " + std::to_string(rt));
    if (!(exponent >= 0.0)) complain("the exponent of w_R must be positive, found " + std::to_string(exponent));
    if (rc > cutoff || rd > cutoff || rt > cutoff)
      complain("the ranges rc = " + std::to_string(rc) + " and rd = " + std::to_string(rd) +
                   (rt > 0.0 ? " and rt = " + std::to_string(rt) : "") + " must not exceed the cut-off of pair_style, " +
                   std::to_string(cutoff));
  }

  rust::Box<Style> make_from(double kt, rust::Slice<const Coefficients> pairs) override
  {
    if (lucy && !atom->mass)
      complain("'law lucy' weighs densities by the masses of types, which this atom style does not have");
    built_masses = masses();
    return warren_style(kt, pairs, atom->ntypes, domain->dimension, {built_masses.data(), built_masses.size()});
  }

  bool is_stale() override { return PairTable::is_stale() || masses() != built_masses; }

 private:
  // LAMMPS's mdpd weighs densities by the masses of the neighbours' types. Without 'law lucy' there are no such weights.
  std::vector<double> masses() const
  {
    if (!lucy || !atom->mass) return {};
    return {atom->mass + 1, atom->mass + 1 + atom->ntypes};
  }

  bool lucy = false;
  std::vector<double> built_masses;
};

}    // namespace psidpd

extern "C" void *psidpd_create_mdpd_psi(void *lmp)
{
  return static_cast<LAMMPS_NS::Pair *>(new psidpd::PairMDPDPsi(static_cast<LAMMPS_NS::LAMMPS *>(lmp)));
}
