#include "pair_table.h"

#include "restart.h"

#include "atom.h"
#include "error.h"
#include "lammps.h"
#include "memory.h"
#include "utils.h"

#include <cstring>
#include <sstream>

using namespace LAMMPS_NS;
using namespace psidpd;

PairTable::PairTable(LAMMPS *lmp, const char *name, std::vector<std::string> names, size_t optional) :
    PairPsi(lmp, name), names(std::move(names)), needed(this->names.size() - optional)
{
  writedata = 1;
}

PairTable::~PairTable()
{
  for (auto &table : value) memory->destroy(table);
}

void PairTable::read_settings(int narg, char **arg)
{
  if (narg < 3)
    stop("expected 'pair_style " + name + " T cutoff seed' and optional keywords, found " + std::to_string(narg) + " arguments");
  read_temperature(arg[0]);
  cutoff = utils::numeric(FLERR, arg[1], false, lmp);
  if (!(cutoff > 0.0)) stop(std::string("the cut-off must be positive, found ") + arg[1]);
  read_seed(arg[2]);
  read_keywords(3, narg, arg);
}

void PairTable::coeff(int narg, char **arg)
{
  const int count = static_cast<int>(names.size());
  if (narg < 2 + static_cast<int>(needed) || narg > 2 + count) {
    std::string expected = "expected 'pair_coeff I J";
    for (size_t k = 0; k < names.size(); k++) expected += (k == needed ? " [" : " ") + names[k];
    stop(expected + (needed < names.size() ? "]" : "") + "', found " + std::to_string(narg) + " arguments");
  }
  const int types = atom->ntypes;
  if (!allocated) allocate();
  while (value.size() < names.size()) {
    double **table = nullptr;
    memory->create(table, types + 1, types + 1, "pair:coefficient");
    for (int i = 0; i <= types; i++)
      for (int j = 0; j <= types; j++) table[i][j] = 0.0;
    value.push_back(table);
  }

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, types, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, types, jlo, jhi, error);
  Coefficients given{true, {}};
  for (int k = 0; k < narg - 2; k++) given.value[k] = utils::numeric(FLERR, arg[2 + k], false, lmp);
  attempt<true>([&] { check(given); });

  int set = 0;
  for (int i = ilo; i <= ihi; i++)
    for (int j = (jlo > i ? jlo : i); j <= jhi; j++) {
      for (int k = 0; k < count; k++) value[k][i][j] = given.value[k];
      setflag[i][j] = 1;
      set++;
    }
  if (set == 0)
    stop(std::string("pair_coeff ") + arg[0] + " " + arg[1] + " sets no pair of types: the first must not exceed the second");
}

std::vector<Coefficients> PairTable::table() const
{
  const int types = atom->ntypes;
  std::vector<Coefficients> all(static_cast<size_t>(types) * types, Coefficients{false, {}});
  if (value.empty()) return all;
  for (int i = 1; i <= types; i++)
    for (int j = i; j <= types; j++) {
      auto &pair = all[static_cast<size_t>(i - 1) * types + j - 1];
      pair.set = setflag[i][j];
      if (pair.set)
        for (size_t k = 0; k < value.size(); k++) pair.value[k] = value[k][i][j];
    }
  return all;
}

// Gives pairs that a hybrid leaves to another style the coefficients of a pair that is set: the model needs some,
// and the pairs themselves are left out.
std::vector<Coefficients> PairTable::without_gaps(std::vector<Coefficients> pairs) const
{
  const size_t types = atom->ntypes;
  std::vector<char> known(types, 0);
  const Coefficients *any = nullptr;
  const auto given = pairs;
  for (size_t k = 0; k < given.size(); k++) {
    if (!given[k].set) continue;
    known[k / types] = known[k % types] = 1;
    if (!any) any = &given[k];
  }
  for (size_t k = 0; k < pairs.size(); k++)
    if (!pairs[k].set && k / types <= k % types && known[k / types] && known[k % types]) pairs[k] = *any;
  return pairs;
}

bool PairTable::is_stale()
{
  return table() != built;
}

rust::Box<Style> PairTable::make_style(double kt)
{
  if (value.empty()) complain("no coefficients: set them with pair_coeff");
  const auto now = table();
  for (const auto &pair : now)
    if (pair.set) check(pair);
  const auto filled = without_gaps(now);
  auto made = make_from(kt, {filled.data(), filled.size()});
  built = now;
  return made;
}

void *PairTable::extract(const char *what, int &dim)
{
  for (size_t k = 0; k < value.size(); k++)
    if (names[k] == what) {
      dim = 2;
      return value[k];
    }
  return PairPsi::extract(what, dim);
}

// Coefficients as text, such as "1 2 -40 25 18 1 0.75".
std::string PairTable::words(int i, int j) const
{
  std::string line = std::to_string(i) + " " + std::to_string(j);
  size_t count = value.size();
  while (count > needed && value[count - 1][i][j] == 0.0) count--;
  for (size_t k = 0; k < count; k++) line += " " + exact(value[k][i][j]);
  return line;
}

std::vector<std::string> PairTable::coefficients()
{
  std::vector<std::string> lines;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j]) lines.push_back(words(i, j));
  return lines;
}

void PairTable::restore(const std::vector<std::string> &lines)
{
  for (const auto &line : lines) {
    std::istringstream stream(line);
    std::vector<std::string> texts;
    for (std::string word; stream >> word;) texts.push_back(word);
    std::vector<char *> arg;
    for (auto &word : texts) arg.push_back(&word[0]);
    coeff(static_cast<int>(arg.size()), arg.data());
  }
}

void PairTable::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) {
    const std::string line = words(i, i);
    fprintf(fp, "%s\n", line.substr(line.find(' ') + 1).c_str());
  }
}

void PairTable::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) fprintf(fp, "%s\n", words(i, j).c_str());
}
