/* pair_style dpd/psi T seed [precision double | mixed] [threads N]
   pair_coeff * * MODEL.toml SPECIES-OF-TYPE-1 SPECIES-OF-TYPE-2 ... */

#include "pair_psi.h"

#include "atom.h"
#include "domain.h"
#include "lammps.h"
#include "update.h"
#include "utils.h"

#include <cstring>

using namespace LAMMPS_NS;

namespace psidpd {

class PairDPDPsi : public PairPsi {
 public:
  explicit PairDPDPsi(LAMMPS *lmp) : PairPsi(lmp, "dpd/psi") { one_coeff = 1; }

  void coeff(int narg, char **arg) override;

 protected:
  void read_settings(int narg, char **arg) override
  {
    if (narg < 2)
      stop("expected 'pair_style dpd/psi T seed' and optional keywords, found " + std::to_string(narg) +
           " arguments");
    read_temperature(arg[0]);
    read_seed(arg[1]);
    read_keywords(2, narg, arg);
    given = false;
  }

  rust::Box<Style> make_style(double kt) override
  {
    if (text.empty()) complain("no model: give one with 'pair_coeff * * MODEL.toml SPECIES ...'");
    return style_from_text(source, text, update->unit_style, kt, names, domain->dimension);
  }

  // The engine has checked the units of the model.
  void check_units(const std::string &) override {}

  std::vector<std::string> coefficients() override
  {
    std::vector<std::string> texts = {source, text};
    for (const auto &name : names) texts.emplace_back(name);
    return texts;
  }

  void restore(const std::vector<std::string> &texts) override
  {
    if (texts.size() != 2 + static_cast<size_t>(atom->ntypes))
      stop("the restart file does not hold what this style writes");
    source = texts[0];
    text = texts[1];
    set_names({texts.begin() + 2, texts.end()});
    style.reset();
  }

 private:
  void set_names(const std::vector<std::string> &given)
  {
    names.clear();
    // A name that is not UTF-8 is that of no species, and the model says so.
    for (const auto &name : given) names.push_back(rust::String::lossy(name));
    for (int i = 1; i <= atom->ntypes; i++)
      for (int j = i; j <= atom->ntypes; j++) setflag[i][j] = given[i - 1] != "NULL" && given[j - 1] != "NULL";
  }

  // Whether pair_coeff has been read since pair_style.
  bool given = false;
  // The model file; restart files contain its text.
  std::string source, text;
  rust::Vec<rust::String> names;
};

void PairDPDPsi::coeff(int narg, char **arg)
{
  const int types = atom->ntypes;
  if (narg != 3 + types)
    stop("expected 'pair_coeff * * MODEL.toml' and a species (or NULL) for each of " + std::to_string(types) +
         " atom types, found " + std::to_string(narg) + " arguments");
  if (strcmp(arg[0], "*") != 0 || strcmp(arg[1], "*") != 0)
    stop("pair_coeff must begin with '* *': one model file describes all types");
  if (!allocated) allocate();
  if (given) warn(std::string("this pair_coeff replaces the model ") + source + " of the previous pair_coeff");

  // The file is searched as other styles do: in the working folder, then in LAMMPS_POTENTIALS.
  std::string path = utils::get_potential_file_path(arg[2]);
  if (path.empty()) path = arg[2];
  set_names({arg + 3, arg + narg});
  attempt<true>([&] {
    const std::string read(read_model({reinterpret_cast<const uint8_t *>(path.data()), path.size()}));
    const std::string shown(rust::String::lossy(path));
    style_from_text(shown, read, update->unit_style, kt(), names, domain->dimension);
    source = shown;
    text = read;
  });
  given = true;
  // init_style() builds a new engine from the new model.
  style.reset();
}

}    // namespace psidpd

extern "C" void *psidpd_create_dpd_psi(void *lmp)
{
  return static_cast<LAMMPS_NS::Pair *>(new psidpd::PairDPDPsi(static_cast<LAMMPS_NS::LAMMPS *>(lmp)));
}
