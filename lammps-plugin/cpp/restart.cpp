#include "restart.h"

#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "utils.h"

using namespace LAMMPS_NS;

std::string psidpd::exact(double value)
{
  char text[40];
  snprintf(text, sizeof(text), "%.17g", value);
  return text;
}

void psidpd::write_texts(FILE *fp, const std::vector<std::string> &texts)
{
  const int count = static_cast<int>(texts.size());
  fwrite(&count, sizeof(int), 1, fp);
  for (const auto &text : texts) {
    const int length = static_cast<int>(text.size());
    fwrite(&length, sizeof(int), 1, fp);
    fwrite(text.data(), 1, text.size(), fp);
  }
}

namespace {

// Longer than any text that is written: a foreign file must not fill the memory.
constexpr int LONGEST = 1 << 25;

int read_int(FILE *fp, LAMMPS *lmp)
{
  int value = 0;
  if (lmp->comm->me == 0) utils::sfread(FLERR, &value, sizeof(int), 1, fp, nullptr, lmp->error);
  MPI_Bcast(&value, 1, MPI_INT, 0, lmp->world);
  if (value < 0 || value > LONGEST)
    lmp->error->all(FLERR, std::string("psidpd: the restart file does not hold what this style writes"));
  return value;
}

}    // namespace

std::vector<std::string> psidpd::read_texts(FILE *fp, LAMMPS *lmp)
{
  std::vector<std::string> texts(read_int(fp, lmp));
  for (auto &text : texts) {
    text.resize(read_int(fp, lmp));
    if (text.empty()) continue;
    if (lmp->comm->me == 0) utils::sfread(FLERR, &text[0], 1, text.size(), fp, nullptr, lmp->error);
    MPI_Bcast(&text[0], static_cast<int>(text.size()), MPI_CHAR, 0, lmp->world);
  }
  return texts;
}
