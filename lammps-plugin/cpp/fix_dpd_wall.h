/* fix ID group dpd/wall SURFACE ... keyword value ...

   Matter behind faces of the box, cylinders and spheres, for a psidpd pair style. */

#ifndef PSIDPD_FIX_DPD_WALL_H
#define PSIDPD_FIX_DPD_WALL_H

#include "fix.h"
#include "psidpd-lammps/src/bridge.rs.h"

#include <array>
#include <string>
#include <vector>

namespace psidpd {

class PairPsi;

std::string name_of(const WallOfFix &wall);
bool is_same_face(const WallOfFix &one, const WallOfFix &two);
// Whether a direction is across the surface.
bool is_across(const WallOfFix &wall, int direction);

class FixDPDWall : public LAMMPS_NS::Fix {
 public:
  FixDPDWall(LAMMPS_NS::LAMMPS *lmp, int narg, char **arg);

  int setmask() override;
  void init() override;
  void setup(int vflag) override;
  void min_setup(int vflag) override { setup(vflag); }
  // Reflection at cylinders and spheres.
  void post_integrate() override;
  // Reflects atoms of the group that are also in the group `moved`, after a whole drift (0) or the first or the second half of one,
  // where velocities have got `kicked` of the kick; `left` keeps three numbers for each atom from the first half to the second, and is
  // empty for a whole one.
  void reflect(int part, double kicked, int moved, rust::Slice<double> left);
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
  // Reads a cylinder or a sphere at `k`, and moves `k` to its last word; returns whether there is one.
  bool read_round(int &k, int narg, char **arg);
  // Reads the keyword at `k` and its values; returns the place of the next one.
  int read_keyword(int k, int narg, char **arg);
  double number(const char *text, const std::string &key, bool can_be_zero);
  // Stops at surfaces that the box cannot have.
  void check_surfaces();
  void check_atoms();
  void find_masses(int group, int other);
  void check_others();
  bool shares_atoms(const LAMMPS_NS::Fix *other) const;
  void show_virial();

  std::vector<WallOfFix> matter;
  PairPsi *pair = nullptr;
  bool warned = false;
  // Whether fix dpd/splitting moves atoms, and asks for reflections.
  bool splits = false;
  // What this rank's atoms give to each wall in the last evaluation, without drag and noise.
  std::vector<OnWall> taken;
  // The mean force of drag and noise in the last timestep on each wall of all fixes, and the virial of that on the atoms.
  std::vector<double> given;
  std::array<double, 6> friction{};
  // The mean force of reflections in the timestep on each wall, and what presses on its surface.
  std::vector<double> pushed;
  std::vector<double> masses;
};

}    // namespace psidpd

#endif
