/* Texts in restart files. */

#ifndef PSIDPD_RESTART_H
#define PSIDPD_RESTART_H

#include "pointers.h"

#include <cstdio>
#include <string>
#include <vector>

namespace psidpd {

// Seventeen digits: reading the text gives the same number back.
std::string exact(double value);

// Called on rank 0 alone, which has the file open.
void write_texts(FILE *fp, const std::vector<std::string> &texts);

// Called on all ranks; rank 0 has the file open.
std::vector<std::string> read_texts(FILE *fp, LAMMPS_NS::LAMMPS *lmp);

}    // namespace psidpd

#endif
