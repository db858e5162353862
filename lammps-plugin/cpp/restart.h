/* Texts in restart files. */

#ifndef PSIDPD_RESTART_H
#define PSIDPD_RESTART_H

#include "pointers.h"

#include <cstdio>
#include <string>
#include <vector>

namespace psidpd {

// Writes seventeen digits: reading the text restores the exact value.
std::string exact(double value);

// Rank 0 alone calls this; it has the file open.
void write_texts(FILE *fp, const std::vector<std::string> &texts);

// All ranks call this; rank 0 has the file open.
std::vector<std::string> read_texts(FILE *fp, LAMMPS_NS::LAMMPS *lmp);

}    // namespace psidpd

#endif
