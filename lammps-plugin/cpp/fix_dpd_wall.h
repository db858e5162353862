/* fix ID group dpd/wall FACE ... keyword value ...

   A half-space of matter behind a face of the box, for a psidpd pair style. */

#ifndef PSIDPD_FIX_DPD_WALL_H
#define PSIDPD_FIX_DPD_WALL_H

#include "fix.h"
#include "psidpd-lammps/src/bridge.rs.h"

#include <array>
#include <string>
#include <vector>

namespace psidpd {

class PairPsi;

class FixDPDWall : public LAMMPS_NS::Fix {
 public:
  FixDPDWall(LAMMPS_NS::LAMMPS *lmp, int narg, char **arg);

  int setmask() override;
  void init() override;
  void setup(int vflag) override;
  void min_setup(int vflag) override { setup(vflag); }
  // Shows the virial of the forces that the pair style has added.
  void post_force(int vflag) override;
  void min_post_force(int vflag) override { post_force(vflag); }
  // Drag and noise.
  void end_of_step() override;
  double compute_scalar() override;
  double compute_vector(int n) override;
  double compute_array(int i, int j) override;

  // The walls, for the pair style, which adds their densities and forces.
  const std::vector<WallOfFix> &walls() const { return matter; }
  // The index of the first one among the walls of all such fixes.
  int first = 0;

 private:
  [[noreturn]] void stop(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  void warn(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  // Reads a face; returns whether the word is one.
  bool read_face(const std::string &word);
  // Reads the keyword at `k` and its values; returns the place of the next one.
  int read_keyword(int k, int narg, char **arg);
  double number(const char *text, const std::string &key, bool can_be_zero);
  // Stops at faces that the box does not have, or that move.
  void check_faces();
  void check_others();
  bool shares_atoms(const LAMMPS_NS::Fix *other) const;
  void show_virial();

  std::vector<WallOfFix> matter;
  PairPsi *pair = nullptr;
  bool warned = false;
  // What this rank's atoms give to each wall in the last evaluation, without drag and noise.
  std::vector<OnWall> taken;
  // The mean force of drag and noise in the last timestep on each wall of all fixes, and the virial of that on the atoms.
  std::vector<double> given;
  std::array<double, 6> friction{};
  std::vector<double> masses;
};

}    // namespace psidpd

#endif
