/* pair_style mdpd/psi T cutoff seed [law conservative | lucy]
   pair_coeff I J A B gamma rc rd

   The coefficients of the built-in mdpd. 'law lucy' computes the built-in's own force, which has no
   potential; the default is the conservative force of the quadratic kernel. */

#include "pair_psi.h"

#include "atom.h"
#include "domain.h"
#include "error.h"
#include "lammps.h"
#include "utils.h"

#include <cstring>

using namespace LAMMPS_NS;

namespace psidpd {

class PairMDPDPsi : public PairPsi {
 public:
  explicit PairMDPDPsi(LAMMPS *lmp) : PairPsi(lmp, "mdpd/psi") {}

  void settings(int narg, char **arg) override
  {
    if (narg != 3 && narg != 5)
      stop("expected 'pair_style mdpd/psi T cutoff seed' and perhaps 'law conservative' or 'law lucy', found " +
           std::to_string(narg) + " arguments");
    read_temperature(arg[0]);
    cutoff = utils::numeric(FLERR, arg[1], false, lmp);
    if (!(cutoff > 0.0)) stop(std::string("the cut-off must be positive, found ") + arg[1]);
    read_seed(arg[2]);
    lucy = false;
    if (narg == 5) {
      if (strcmp(arg[3], "law") != 0) stop(std::string("unknown keyword '") + arg[3] + "': expected 'law'");
      if (strcmp(arg[4], "lucy") == 0)
        lucy = true;
      else if (strcmp(arg[4], "conservative") != 0)
        stop(std::string("unknown law '") + arg[4] + "': expected 'conservative' or 'lucy'");
    }
    style.reset();
  }

  void coeff(int narg, char **arg) override
  {
    if (narg != 7)
      stop("expected 'pair_coeff I J A B gamma rc rd', found " + std::to_string(narg) + " arguments");
    if (!allocated) allocate();
    const size_t types = atom->ntypes;
    table.resize(types * types, Coefficients{false, 0.0, 0.0, 0.0, 0.0, 0.0});

    int ilo, ihi, jlo, jhi;
    utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
    utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);
    Coefficients given;
    given.set = true;
    given.a = utils::numeric(FLERR, arg[2], false, lmp);
    given.b = utils::numeric(FLERR, arg[3], false, lmp);
    given.gamma = utils::numeric(FLERR, arg[4], false, lmp);
    given.rc = utils::numeric(FLERR, arg[5], false, lmp);
    given.rd = utils::numeric(FLERR, arg[6], false, lmp);
    if (given.rc > cutoff || given.rd > cutoff)
      stop("the ranges rc = " + std::string(arg[5]) + " and rd = " + arg[6] +
           " must not exceed the cut-off of pair_style, " + std::to_string(cutoff));

    int count = 0;
    for (int i = ilo; i <= ihi; i++)
      for (int j = (jlo > i ? jlo : i); j <= jhi; j++) {
        table[(i - 1) * types + (j - 1)] = given;
        setflag[i][j] = 1;
        count++;
      }
    if (count == 0)
      stop(std::string("pair_coeff ") + arg[0] + " " + arg[1] + " sets no pair of types: the first must not exceed the second");
    style.reset();
  }

 protected:
  void build_style() override
  {
    if (style) return;
    if (table.empty()) stop("no coefficients: set them with pair_coeff");
    std::string trouble;
    try {
      style.emplace(style_from_coefficients(kt, rust::Slice<const Coefficients>(table.data(), table.size()),
                                            atom->ntypes, domain->dimension, lucy));
    } catch (const std::exception &e) {
      trouble = e.what();
    }
    if (!trouble.empty()) stop(trouble);
    // The built-in weighs the density by the neighbours' masses.
    if (lucy && atom->mass)
      for (int t = 1; t <= atom->ntypes; t++)
        if (atom->mass_setflag[t] && atom->mass[t] != 1.0)
          stop("'law lucy' is the built-in's law for masses of 1 only: its densities are weighed by mass, these are number densities");
  }

 private:
  double cutoff = 0.0;
  bool lucy = false;
  std::vector<Coefficients> table;
};

}    // namespace psidpd

extern "C" void *psidpd_create_mdpd_psi(void *lmp)
{
  return static_cast<LAMMPS_NS::Pair *>(new psidpd::PairMDPDPsi(static_cast<LAMMPS_NS::LAMMPS *>(lmp)));
}
