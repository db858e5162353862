/* fix ID group dpd/splitting two-stage | force-gradient | aboba [lambda X] [gradient XI] [every K]
     [noise gaussian | uniform]

   Integrates with the thermostat of a psidpd pair style apart from the forces. */

#ifndef PSIDPD_FIX_SPLITTING_H
#define PSIDPD_FIX_SPLITTING_H

#include "fix.h"
#include "psidpd-lammps/src/bridge.rs.h"

#include <array>
#include <set>
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
  // Finds the atoms whose force other fixes set: drag and noise must not change their velocities either.
  void pre_force(int vflag) override;
  void setup_pre_reverse(int eflag, int vflag) override;
  // Adds drag and noise to the forces that other fixes are going to set, for what those report.
  void pre_reverse(int eflag, int vflag) override;
  void initial_integrate(int vflag) override;
  void final_integrate() override;
  void post_run() override;
  double compute_scalar() override;

  // Shifts and pushes move with their atoms to other ranks.
  void set_arrays(int i) override;
  void grow_arrays(int most) override;
  void copy_arrays(int from, int to, int delflag) override;
  int pack_exchange(int i, double *buf) override;
  int unpack_exchange(int i, double *buf) override;
  double memory_usage() override;

 private:
  [[noreturn]] void stop(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  // Warns on one rank.
  void warn(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  // Stops at fixes that also move atoms, or that expect one evaluation of forces in each step, and warns of unknown ones.
  void check_others();
  // How often forces are computed in a timestep, in words.
  std::string evaluations() const;
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
  // Lets round walls of fixes dpd/wall reflect atoms after the first or the second half of a drift, where velocities have got `kicked` of
  // the kick.
  void bounce(int part, double kicked);
  // Lets fixes of walls reflect atoms that have moved, in addition to their own call.
  void reflect();
  // Updates positions of ghosts, and finds new ghosts where atoms have moved too far since the last search.
  void follow();
  bool are_far();
  void find_ghosts_anew();
  // Moves the atoms of the group by ξΔt² f/m, computes all forces there, and restores x.
  void compute_displaced_forces();
  // Adds the shifts to x; restore() subtracts them.
  void shift();
  void restore();
  // Computes all forces at the present positions, as a step of run_style verlet does.
  void compute_forces(int eflag, int vflag);
  bool is_due() const;
  void expect();
  // Whether the virial of drag and noise is computed where they act: with every 2 and more, later steps may ask for it.
  bool wants_virial() const { return thermo_virial && (every > 1 || vflag_of_step); }
  void show_virial(int vflag);
  // Applies drag and noise to the present velocities, and keeps their mean forces.
  void act();
  // Finds what drag and noise would do now, for what is reported before they first act.
  void rehearse();
  // Adds what other fixes add to forces.
  void add_forces(int vflag);
  // Whether the fix with number k is a wall that has not been found too stiff.
  bool is_watched(int k) const;
  // Adds the forces of a wall; warns if they are too strong for the timestep.
  void watch(LAMMPS_NS::Fix *wall, int vflag);
  // Watches all walls where LAMMPS itself has added their forces, and leaves the forces as they are.
  void watch_walls();
  // For which part of a timestep the forces at its end act, on average; those in the middle act for the rest.
  double share_of_end() const { return scheme == Scheme::aboba ? 0.0 : 2.0 * lambda; }
  // Stores the pushes of the last action.
  void keep_pushes();
  // Marks the atoms whose force a fix replaces.
  void find_held(LAMMPS_NS::Fix *fix);

  enum class Scheme { two_stage, force_gradient, aboba };
  Scheme scheme = Scheme::two_stage;
  double lambda;
  // Coefficient ξ of the force gradient.
  double gradient;
  LAMMPS_NS::bigint every = 1;
  bool uniform = false;
  PairPsi *pair = nullptr;
  // For each atom the directions in which other fixes set its force: bit 0 for x, 1 for y, 2 for z.
  std::vector<uint8_t> held;
  // Whether there are fixes that set forces; all ranks agree.
  bool has_setters = false;
  // Number of atoms that the arrays have room for.
  int room = 0;
  // For each atom, in the directions in which its force is set, the mean force of drag and noise since they last acted, and what
  // forces in the middle of the timestep add to its mean force.
  double **pushes = nullptr;
  // Which forces are computed.
  enum class Evaluation { other, middle, end };
  Evaluation evaluation = Evaluation::other;
  // The virial of the mean forces of drag and noise since they last acted.
  std::array<double, 6> impulses{};
  // Masses for the thermostat, infinite for atoms that keep their velocities.
  std::vector<double> masses;
  // IDs of fixes that a warning has named.
  std::set<std::string> named;
  // IDs of walls that a warning of this run has named.
  std::set<std::string> too_stiff;
  // Whether this run has warned that the thermostat is inaccurate.
  bool warned = false;
  // Iterations of the thermostat before this run.
  Effort before{};
  // Flag of the virial of the present step.
  int vflag_of_step = 0;
  // How far the place of each atom that waits at a round wall in the middle of a timestep would lie behind it.
  double **beyond = nullptr;
  // For force-gradient: the displacement of each atom, and its position before. For aboba: the force in the middle of the last timestep.
  double **shifts = nullptr;
  // Whether aboba has computed other forces since.
  bool holds = false;
  std::vector<double> home;
  // Forces before a probe, or a wall, changes them.
  std::vector<double> covered;
};

}    // namespace psidpd

#endif
