/* fix ID group dpd/splitting two-stage | force-gradient | aboba [lambda X] [gradient XI] [every K]
     [noise gaussian | uniform]

   Integrates with the thermostat of a psidpd pair style apart from the forces. */

#ifndef PSIDPD_FIX_SPLITTING_H
#define PSIDPD_FIX_SPLITTING_H

#include "fix.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {
class Modify;
}

namespace psidpd {

class PairPsi;

class FixSplitting : public LAMMPS_NS::Fix {
 public:
  FixSplitting(LAMMPS_NS::LAMMPS *lmp, int narg, char **arg);
  ~FixSplitting() override;

  FixSplitting(const FixSplitting &) = delete;
  FixSplitting &operator=(const FixSplitting &) = delete;

  // The fix of this style that there is, if any.
  static FixSplitting *find(const LAMMPS_NS::Modify *modify);

  int setmask() override;
  void init() override;
  void setup(int vflag) override;
  void initial_integrate(int vflag) override;
  void final_integrate() override;
  double compute_scalar() override;

  // Shifts go with their atoms to other ranks.
  void grow_arrays(int most) override;
  void copy_arrays(int from, int to, int delflag) override;
  int pack_exchange(int i, double *buf) override;
  int unpack_exchange(int i, double *buf) override;
  double memory_usage() override;

 private:
  [[noreturn]] void stop(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  void check_others();
  // The pair style whose thermostat this is.
  PairPsi *find_pair();

  // v += h f/m of the atoms of the group.
  void kick(double h);
  // x += h v of the same.
  void drift(double h);
  // Lets walls reflect what has moved, beside their own turn.
  void reflect();
  // Brings ghosts to where their atoms are, with new ones where atoms have gone too far since the last were found.
  void follow();
  bool are_far();
  void find_ghosts_anew();
  // x += ξΔt² f/m of the atoms of the group, all forces there, and x as before.
  void compute_displaced_forces();
  void keep_shifts();
  // Adds the shifts to x, which restore() takes back.
  void shift();
  void restore();
  // All forces at the present positions, as a step of run_style verlet computes them.
  void compute_forces(int eflag, int vflag);
  void act();

  enum class Scheme { two_stage, force_gradient, aboba };
  Scheme scheme = Scheme::two_stage;
  double lambda;
  // ξ.
  double gradient;
  LAMMPS_NS::bigint every = 1;
  bool uniform = false;
  PairPsi *pair = nullptr;
  // Of the present step.
  int vflag_of_step = 0;
  // Of force-gradient, for each atom: how far it is displaced, and where it was.
  double **shifts = nullptr;
  std::vector<double> home;
};

}    // namespace psidpd

#endif
