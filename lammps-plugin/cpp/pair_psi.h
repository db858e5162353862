/* The pair style that psidpd's styles share: an engine of the model, and LAMMPS around it. */

#ifndef PSIDPD_PAIR_PSI_H
#define PSIDPD_PAIR_PSI_H

#include "exclusions.h"
#include "ghost_exchange.h"
#include "ghost_reach.h"
#include "listed_pairs.h"
#include "lost_atoms.h"
#include "pair.h"
#include "psidpd-lammps/src/bridge.rs.h"
#include "special_pairs.h"

#include <array>
#include <cstdint>
#include <exception>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace psidpd {

class PairPsi : public LAMMPS_NS::Pair {
 public:
  explicit PairPsi(LAMMPS_NS::LAMMPS *lmp, const char *name);
  ~PairPsi() override;

  PairPsi(const PairPsi &) = delete;
  PairPsi &operator=(const PairPsi &) = delete;

  void compute(int eflag, int vflag) override;
  void settings(int narg, char **arg) override;
  void init_style() override;
  double init_one(int i, int j) override;

  double single(int i, int j, int itype, int jtype, double rsq, double factor_coul, double factor_lj,
                double &fforce) override;
  void *extract(const char *what, int &dim) override;
  // Older versions of LAMMPS do not declare this function: it has no override.
  virtual void *extract_peratom(const char *what, int &columns);

  void write_restart(FILE *fp) override;
  void read_restart(FILE *fp) override;
  void write_restart_settings(FILE *fp) override;
  void read_restart_settings(FILE *fp) override;

  int pack_forward_comm(int n, int *list, double *buf, int pbc_flag, int *pbc) override;
  void unpack_forward_comm(int n, int first, double *buf) override;
  double memory_usage() override;

  // Why the fix that applies drag and noise apart from the forces cannot act; empty if it can.
  std::string why_not_apart() const;
  // Announces that the thermostat will act, for a time, where the next forces are computed.
  void expect_heat(double time);
  // What drag and noise do.
  struct Action {
    // Time for which they act.
    double time;
    bool uniform;
    // Whether to find the virial, and the forces on atoms of infinite mass.
    bool wants_virial, wants_fixed;
  };
  // Applies drag and noise to the velocities of atoms with these masses (energy over squared velocity), at the positions
  // where forces were last computed. Atoms of infinite mass keep their velocities. Returns the virial of the mean force.
  std::array<double, 6> heat(const std::vector<double> &masses, const Action &action);
  // Atoms are going to be displaced from the present positions, where ghosts may have been found; or are back there.
  void displace(bool away);
  // Applies drag and noise of `count` walls from the wall `first` on to the velocities of atoms with these masses, infinite for
  // those that keep their velocities. Writes the mean force on each wall, and returns the virial of that on the atoms.
  std::array<double, 6> rub(const std::vector<double> &masses, int first, int count, std::vector<double> &given);
  // A drift of atoms: 0 for a whole one, 1 or 2 for half of one, and how much of the kick velocities have got.
  struct Moved {
    int part;
    double kicked;
  };
  // Lets walls from the wall `first` on reflect atoms with these masses, infinite for those that stay. Adds the mean force on each, and what
  // presses on it, to `pushed`.
  void bounce(const std::vector<double> &masses, const Moved &moved, int first, std::vector<double> &pushed, rust::Slice<double> left);
  // Mirrors atoms in the matter of round walls at their surfaces.
  void mirror();
  // The ID of an owned atom in the matter of a round wall; -1 if there is none.
  int64_t find_in_matter();
  // The walls of all fixes dpd/wall.
  const std::vector<WallOfFix> &walls() const { return matter; }
  // The only psidpd style of a simulation; null, with a reason to be added to a sentence, if there is none or several.
  static PairPsi *only(LAMMPS_NS::Force *force, std::string &why);
  // The temperature as an energy.
  double kt() const;
  // The engine, which exists after init_style().
  Style &engine() { return **style; }
  // Iterations of the thermostat in its last update, and of all its updates since the style was set up.
  int iterations() { return style ? static_cast<int>((*style)->iterations()) : 0; }
  Effort effort() { return style ? (*style)->effort() : Effort{}; }

 protected:
  virtual void read_settings(int narg, char **arg) = 0;
  // Builds the engine from the coefficients of pair_coeff; may throw an error of the engine.
  virtual rust::Box<Style> make_style(double kt) = 0;
  // Whether coefficients differ from those that the engine was built with.
  virtual bool is_stale() { return false; }
  // The coefficients of pair_coeff, for restart files.
  virtual std::vector<std::string> coefficients() = 0;
  virtual void restore(const std::vector<std::string> &texts) = 0;
  // Stops if the style does not fit the simulation.
  virtual void check_host();
  // Stops at units that the style does not support; it always supports lj.
  virtual void check_units(const std::string &units);

  // Reads keywords and values from argument `first` on.
  void read_keywords(int first, int narg, char **arg);
  // Reads a keyword of this style alone; returns whether it is known.
  virtual bool read_keyword(const std::string & /*key*/, const std::string & /*value*/) { return false; }
  // Names of the keywords, for messages.
  virtual std::string keywords() const { return "'precision', 'threads' or 'device'"; }

  void allocate();
  // Read and check the temperature and the seed of pair_style.
  void read_temperature(const char *arg);
  void read_seed(const char *arg);
  // Stops with "Pair style NAME: text", on all ranks; LAMMPS adds the file and the line.
  [[noreturn]] void stop(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  // Warns on one rank with "Pair style NAME: text", with the file and the line.
  void warn(const std::string &text, const char *file = __builtin_FILE(), int line = __builtin_LINE());
  // Throws the text, for errors that make_style finds.
  [[noreturn]] static void complain(const std::string &text);
  // Runs `work`; stops with the text of its error, after the stack of `work` has been unwound: all ranks if all do the work and
  // fail alike, or this rank alone.
  template <bool on_all_ranks = false, class Work>
  auto attempt(Work work, const char *file = __builtin_FILE(), int line = __builtin_LINE())
  {
    std::string trouble;
    try {
      return work();
    } catch (const std::exception &e) {
      trouble = e.what();
    }
    if constexpr (on_all_ranks)
      stop(trouble, file, line);
    else
      stop_here(trouble, file, line);
  }

  const std::string name;
  std::optional<rust::Box<Style>> style;

 private:
  void refresh();
  // The box, and along which directions this rank has all of it.
  Extent extent() const;
  bool is_alone(const Extent &extent) const;
  void find_images();
  Atoms atoms(size_t count) const;
  void find_densities(const Atoms &atoms, const Request &request, rust::Slice<double> f);
  // Whether atoms may see two images of each other.
  bool is_narrow() const;
  // Passes special pairs, those of owned atoms alone or all, and exclusions to the engine.
  void tell_left_out(bool owned_alone);
  // Whether a fix applies drag and noise.
  bool has_splitting() const;
  // Takes the walls of fixes dpd/wall, and returns how many such fixes there are.
  int find_walls();
  int count_walls() const;
  void set_walls();
  double mean_mass() const;
  void forward();
  void forward_vectors();
  rust::Slice<const bool> left_out(Extent &extent, const Request &request) const;
  void check_box();
  void check_plane();
  void check_ghosts();
  void check_lost();
  void check_reach(bool alone);
  void check_thermostats();
  void check_callers();
  bool has_device() const { return given.device != "cpu"; }
  void check_device();
  void advise();
  std::string advice();
  // Whether the last evaluation contained this pair.
  bool is_pair(int i, int j, int itype, int jtype, double rsq) const;
  std::string search();
  [[noreturn]] void stop_here(const std::string &text, const char *file = __builtin_FILE(),
                              int line = __builtin_LINE());

  // The arguments of pair_style.
  struct Given {
    double temperature = 0.0;
    uint64_t seed = 0;
    bool mixed = false;
    size_t threads = 1;
    std::string device;
    std::vector<std::string> arguments;
  };
  Given given;
  double built_kt = 0.0;
  bool described = false;
  // IDs of fixes that a warning has named.
  std::set<std::string> named;
  std::vector<double *> density_rows;

  LostAtoms lost_atoms;
  GhostReach ghost_reach;
  // Whether atoms are displaced from where ghosts are found.
  bool displaced = false;
  GhostExchange exchange;
  // Whether ghosts are away from the images of their atoms, in this evaluation.
  bool strained = false;
  // Whether a fix applied drag and noise at setup.
  bool apart = false;
  // Walls of fixes dpd/wall, those that the engine has, and the number of such fixes at setup.
  std::vector<WallOfFix> matter, built_matter;
  int wall_fixes = 0;
  // Numbers of atoms and ghosts of an evaluation without slopes of ghosts; single() computes those that it needs.
  std::array<int, 2> without_slopes{-1, -1};

  // Why pairs come from LAMMPS's neighbor list; empty if the engine finds them.
  std::string why_listed;
  ListedPairs listed;
  SpecialPairs special;
  Exclusions exclusions;
};

}    // namespace psidpd

#endif
