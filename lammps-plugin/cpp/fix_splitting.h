/* fix ID group dpd/splitting two-stage | force-gradient | aboba [lambda X] [gradient XI] [every K]
     [noise gaussian | uniform]

   Integrates with the thermostat of a psidpd pair style apart from the forces. */

#ifndef PSIDPD_FIX_SPLITTING_H
#define PSIDPD_FIX_SPLITTING_H

#include "fix.h"
#include "psidpd-lammps/src/bridge.rs.h"

#include <string>
#include <vector>

namespace psidpd {

class PairPsi;

class FixSplitting : public LAMMPS_NS::Fix {
 public:
  FixSplitting(LAMMPS_NS::LAMMPS *lmp, int narg, char **arg);
  ~FixSplitting() override;

  FixSplitting(const FixSplitting &) = delete;
  FixSplitting &operator=(const FixSplitting &) = delete;

  int setmask() override;
  void init() override;
  void setup(int vflag) override;
  void setup_pre_force(int vflag) override { pre_force(vflag); }
  // Finds the atoms whose whole force other fixes set: drag and noise must not change their velocities either.
  void pre_force(int vflag) override;
  void initial_integrate(int vflag) override;
  void final_integrate() override;
  void post_run() override;
  double compute_scalar() override;

  // Shifts move with their atoms to other ranks.
  void grow_arrays(int most) override;
  void copy_arrays(int from, int to, int delflag) override;
  int pack_exchange(int i, double *buf) override;
  int unpack_exchange(int i, double *buf) override;
  double memory_usage() override;

 private:
  [[noreturn]] void stop(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  void check_others();
  // Stops at pair styles of a hybrid whose random forces or states expect one evaluation of forces in each step.
  void check_styles_beside();
  // The pair style whose drag and noise this fix applies.
  PairPsi *find_pair();

  // The atoms of this rank, and the group that moves.
  Movers movers() const;
  // v += h f/m of the atoms of the group.
  void kick(double h);
  // x += h v of the atoms of the group.
  void drift(double h);
  // Lets fixes of walls reflect atoms that have moved, in addition to their own call.
  void reflect();
  // Updates positions of ghosts, and finds new ghosts where atoms have moved too far since the last search.
  void follow();
  bool are_far();
  void find_ghosts_anew();
  // Moves the atoms of the group by ξΔt² f/m, computes all forces there, and restores x.
  void compute_displaced_forces();
  void keep_shifts();
  // Adds the shifts to x; restore() subtracts them.
  void shift();
  void restore();
  // Computes all forces at the present positions, as a step of run_style verlet does.
  void compute_forces(int eflag, int vflag);
  bool is_due() const;
  void expect();
  void act();
  // Adds what other fixes add to forces.
  void add_forces(int vflag);
  // What a fix makes of forces that are `scale` times a probe.
  std::vector<double> replaced(LAMMPS_NS::Fix *fix, double scale);

  enum class Scheme { two_stage, force_gradient, aboba };
  Scheme scheme = Scheme::two_stage;
  double lambda;
  // Coefficient ξ of the force gradient.
  double gradient;
  LAMMPS_NS::bigint every = 1;
  bool uniform = false;
  PairPsi *pair = nullptr;
  // For each atom whether other fixes set its whole force.
  std::vector<uint8_t> held;
  // Masses for the thermostat, infinite for atoms that keep their velocities.
  std::vector<double> masses;
  // Iterations of the thermostat before this run.
  Effort before{};
  // Flag of the virial of the present step.
  int vflag_of_step = 0;
  // For force-gradient: the displacement of each atom, and its position before.
  double **shifts = nullptr;
  std::vector<double> home;
};

}    // namespace psidpd

#endif
