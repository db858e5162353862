/* pair_style dpd/psi T seed
   pair_coeff * * MODEL.toml SPECIES-OF-TYPE-1 SPECIES-OF-TYPE-2 ... */

#include "pair_psi.h"

#include "atom.h"
#include "domain.h"
#include "lammps.h"
#include "utils.h"

#include <cstring>

using namespace LAMMPS_NS;

namespace psidpd {

class PairDPDPsi : public PairPsi {
 public:
  explicit PairDPDPsi(LAMMPS *lmp) : PairPsi(lmp, "dpd/psi") { one_coeff = 1; }

  void settings(int narg, char **arg) override
  {
    if (narg != 2) stop("expected 'pair_style dpd/psi T seed', found " + std::to_string(narg) + " arguments");
    read_temperature(arg[0]);
    read_seed(arg[1]);
  }

  void coeff(int narg, char **arg) override
  {
    const int types = atom->ntypes;
    if (narg != 3 + types)
      stop("expected 'pair_coeff * * MODEL.toml' and a species (or NULL) for each of " +
           std::to_string(types) + " atom types, found " + std::to_string(narg) + " arguments");
    if (strcmp(arg[0], "*") != 0 || strcmp(arg[1], "*") != 0)
      stop("pair_coeff must begin with '* *': one model file describes all types");
    if (!allocated) allocate();

    // As other styles with files: here, or where LAMMPS_POTENTIALS says.
    std::string path = utils::get_potential_file_path(arg[2]);
    if (path.empty()) path = arg[2];
    rust::Vec<rust::String> names;
    for (int t = 0; t < types; t++) names.push_back(arg[3 + t]);
    std::string trouble;
    try {
      style.emplace(style_from_file(path, kt, names, domain->dimension));
    } catch (const std::exception &e) {
      trouble = e.what();
    }
    if (!trouble.empty()) stop(trouble);

    for (int i = 1; i <= types; i++)
      for (int j = i; j <= types; j++)
        setflag[i][j] = names[i - 1] != "NULL" && names[j - 1] != "NULL";
  }

 protected:
  void build_style() override
  {
    if (!style) stop("no model: give one with 'pair_coeff * * MODEL.toml SPECIES ...'");
  }
};

}    // namespace psidpd

extern "C" void *psidpd_create_dpd_psi(void *lmp)
{
  return static_cast<LAMMPS_NS::Pair *>(new psidpd::PairDPDPsi(static_cast<LAMMPS_NS::LAMMPS *>(lmp)));
}
