#include "pair_psi.h"

#include "compat.h"
#include "restart.h"

#include "atom.h"
#include "citeme.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

using namespace LAMMPS_NS;
using namespace psidpd;

namespace {

const char cite_psidpd[] =
    "psidpd: many-body DPD from excess free energies\n\n"
    "@Article{Pagonabarraga01,\n"
    " author = {I. Pagonabarraga and D. Frenkel},\n"
    " title = {Dissipative particle dynamics for interacting systems},\n"
    " journal = {J.~Chem.~Phys.},\n volume = 115,\n pages = 5015,\n year = 2001\n}\n\n"
    "@Article{Trofimov02,\n"
    " author = {S. Y. Trofimov and E. L. F. Nies and M. A. J. Michels},\n"
    " title = {Thermodynamic consistency in dissipative particle dynamics simulations of strongly nonideal "
    "liquids and liquid mixtures},\n"
    " journal = {J.~Chem.~Phys.},\n volume = 117,\n pages = 9383,\n year = 2002\n}\n\n"
    "@Article{Warren03,\n"
    " author = {P. B. Warren},\n"
    " title = {Vapor-liquid coexistence in many-body dissipative particle dynamics},\n"
    " journal = {Phys.~Rev.~E},\n volume = 68,\n pages = 066702,\n year = 2003\n}\n\n";

}    // namespace

PairPsi::PairPsi(LAMMPS *lmp, const char *name) : Pair(lmp), name(name)
{
  single_enable = 1;
  restartinfo = 1;
  manybody_flag = 1;
  // The engine sums the virial pair by pair: LAMMPS needs no forces on ghosts for it.
  no_virial_fdotr_compute = 1;
  nextra = 4;
  pvector = new double[nextra];
  for (int k = 0; k < nextra; k++) pvector[k] = 0.0;
  if (lmp->citeme) lmp->citeme->add(cite_psidpd);
}

PairPsi::~PairPsi()
{
  delete[] pvector;
  if (allocated) {
    memory->destroy(setflag);
    memory->destroy(cutsq);
  }
}

void PairPsi::stop(const std::string &text, const char *file, int line)
{
  error->all(file, line, "Pair style " + name + ": " + text);
}

void PairPsi::warn(const std::string &text, const char *file, int line)
{
  if (comm->me == 0) error->warning(file, line, "Pair style " + name + ": " + text);
}

// An error on one rank stops all ranks: the text names the particle.
void PairPsi::stop_here(const std::string &text, const char *file, int line)
{
  error->one(file, line, "Pair style " + name + " at step " + std::to_string(update->ntimestep) + ": " + text);
}

void PairPsi::complain(const std::string &text)
{
  throw std::runtime_error(text);
}

void PairPsi::allocate()
{
  const int n = atom->ntypes;
  memory->create(setflag, n + 1, n + 1, "pair:setflag");
  memory->create(cutsq, n + 1, n + 1, "pair:cutsq");
  for (int i = 1; i <= n; i++)
    for (int j = 1; j <= n; j++) {
      setflag[i][j] = 0;
      cutsq[i][j] = 0.0;
    }
  allocated = 1;
}

void PairPsi::read_temperature(const char *arg)
{
  const double t = utils::numeric(FLERR, arg, false, lmp);
  if (!(t > 0.0) || !std::isfinite(t))
    stop(std::string("the temperature must be positive, found ") + arg);
  given.temperature = t;
}

double PairPsi::kt() const
{
  return force->boltz * given.temperature;
}

void PairPsi::read_seed(const char *arg)
{
  const bigint value = utils::bnumeric(FLERR, arg, false, lmp);
  if (value <= 0) stop(std::string("the seed must be a positive whole number, found ") + arg);
  given.seed = static_cast<uint64_t>(value);
}

// Reads the keywords that all styles share, at the end of pair_style; the other keywords belong to one style.
void PairPsi::read_keywords(int first, int narg, char **arg)
{
  given.mixed = false;
  given.threads = 1;
  given.device = "cpu";
  bool asks_double = false;
  for (int k = first; k < narg; k += 2) {
    const std::string key = arg[k];
    if (k + 1 >= narg) stop("keyword '" + key + "' needs a value");
    const std::string value = arg[k + 1];
    if (read_keyword(key, value)) continue;
    if (key == "precision") {
      if (value != "mixed" && value != "double")
        stop("unknown precision '" + value + "': expected 'mixed' or 'double'");
      given.mixed = value == "mixed";
      asks_double = value == "double";
    } else if (key == "device") {
      given.device = value;
    } else if (key == "threads") {
      const int count = utils::inumeric(FLERR, value.c_str(), false, lmp);
      given.threads = std::max(count, 0);
    } else {
      stop("unknown keyword '" + key + "': expected " + keywords());
    }
  }
  if (has_device() && asks_double) stop("a GPU computes in single precision: leave out 'precision double'");
}

void PairPsi::settings(int narg, char **arg)
{
  read_settings(narg, arg);
  given.arguments.assign(arg, arg + narg);
  // init_style() builds an engine with the new settings, and describes it.
  style.reset();
  described = false;
}

// Builds the engine, or updates it: fix adapt may have changed its coefficients or the temperature.
void PairPsi::refresh()
{
  if (style && !is_stale() && kt() == built_kt && matter == built_matter) return;
  if (!(given.temperature > 0.0) || !std::isfinite(given.temperature))
    stop("the temperature must be positive, found " + std::to_string(given.temperature));
  special.forget();
  exclusions.forget();
  attempt<true>([&] {
    if (!style || is_stale()) {
      built_matter.clear();
      style.emplace(make_style(kt()));
    } else if (kt() != built_kt) {
      (*style)->set_temperature(kt());
    }
    (*style)->configure(given.mixed, given.threads);
    (*style)->use_device(given.device);
    set_walls();
  });
  built_kt = kt();
}

void PairPsi::init_style()
{
  wall_fixes = find_walls();
  refresh();
  attempt<true>([&] { (*style)->check_room(extent()); });
  apart = has_splitting();
  check_host();
  check_callers();
  check_thermostats();
  check_box();
  lost_atoms.begin(atom, world);
  // LAMMPS sizes its buffers by this; later communications never send more.
  comm_forward = static_cast<int>((*style)->facts().variables);
  special.begin(atom, world);
  exclusions.begin(atom->ntypes);

  why_listed.clear();
  const auto because = [this](const std::string &text) { why_listed += (why_listed.empty() ? "" : " and ") + text; };
  if (special.are_scaled(atom, force)) {
    if (atom->molecular == Atom::TEMPLATE) because("special_bonds with atom_style template");
    if (atom->map_style == Atom::MAP_NONE) because("special_bonds without an atom map");
    if (is_narrow()) because("special_bonds in a box narrower than twice the cut-off");
  }
  // A fix may exclude more pairs when LAMMPS sets it up, after the pair styles.
  if (exclusions.rules(neighbor, setflag) - neighbor->nex_mol > Exclusions::most_rules || neighbor->nex_mol > 1)
    because("more exclusions of neigh_modify than it can keep");
  if (neighbor->includegroup) because("neigh_modify include");
  // These fixes exclude a group of their own, and do so only after pair styles have requested their lists.
  for (int k = 0; k < modify->nfix; k++) {
    const char *fix = modify->fix[k]->style;
    for (const char *known : {"gcmc", "widom", "charge/regulation"})
      if (strcmp(fix, known) == 0) because(std::string("fix ") + known);
  }
  if (!why_listed.empty() && !matter.empty())
    stop("fix dpd/wall cannot act here: pairs come from a neighbor list, because of " + why_listed);
  if (!why_listed.empty()) listed.full = request_list(neighbor, this, instance_me, 0);
  check_device();
  // With newton off a half list contains the pairs of owned atoms with ghosts on both sides, which is sufficient.
  if (!why_listed.empty() && !listed.full && force->newton_pair)
    stop("with " + why_listed + " this version of LAMMPS needs 'newton off'");

  if (!described && comm->me == 0)
    utils::logmesg(lmp, std::string((*style)->description(search(), !why_listed.empty(), apart)) + advice());
  if (!described) advise();
  described = true;
}

// Warns of settings that have no effect, or that slow the run down.
void PairPsi::advise()
{
  if (lmp->suffix_enable)
    warn("there is no accelerated variant, and the suffix has no effect: use the keywords 'precision mixed' and "
         "'threads'");
  const size_t used = (*style)->facts().threads;
  if (used < given.threads)
    warn("threads " + std::to_string(given.threads) + " is more than the processors that this process may use: using " +
         std::to_string(used) + ", with the same results");
}

// Settings that would make the run faster, with factors measured in Warren's liquid.
std::string PairPsi::advice()
{
  std::string text;
  const auto add = [&text](const std::string &line) { text += "  advice        " + line + "\n"; };
  if (why_listed.empty() && !given.mixed && !has_device()) add("'precision mixed' evaluates forces some 1.3 times faster");
  // Bonds and other styles leave forces on ghosts, and need them.
  if (why_listed.empty() && force->pair == this && atom->molecular == Atom::ATOMIC) {
    if (force->newton)
      add(std::string("'newton off' saves sending back forces on ghosts, ") +
          (comm->nprocs > 1 ? "up to a tenth of a step" : "a few percent of a step") + ": this style leaves none there");
    if (comm->nprocs == 1 && neighbor->skin > 0.0 && domain->periodicity[0] && domain->periodicity[1] && domain->periodicity[2])
      add("on one rank 'neighbor 0.0 bin' and 'neigh_modify delay 0 every 20 check no' save the ghosts, a tenth to a third of a "
          "step, unless a compute or fix needs them");
  }
  // The layout becomes tiled when it is balanced, which may be later.
  if (why_listed.empty() && comm->nprocs > 1 && is_tiled(comm))
    add("in a tiled layout each rank works on ghosts along all periodic directions, also images of its own atoms; a brick layout "
        "has none along directions with one rank");
  const auto is_nve = [](const Fix *fix) { return strcmp(fix->style, "nve") == 0; };
  if (!apart && why_listed.empty() && exclusions.rules(neighbor, setflag) == 0 && std::any_of(modify->fix, modify->fix + modify->nfix, is_nve))
    add("'fix dpd/splitting' in place of fix nve takes timesteps six times as long: some 1.5 to 2 times faster, and with "
        "force-gradient more accurate");
  return text;
}

std::string PairPsi::search()
{
  if (why_listed.empty()) {
    std::string text = "own cell list every step; no neighbor list is requested";
    if (exclusions.rules(neighbor, setflag) > 0) text += "\n  exclusions    pairs that neigh_modify excludes are left out";
    if (special.are_scaled(atom, force))
      text += "\n  special bonds factors above 0 scale phi and w of bonded neighbors, not drag and noise; with 0 they do not "
              "interact\n  advice        in DPD 'special_bonds lj 1 1 1' is usual, bonded atoms interacting like all others";
    return text;
  }
  return std::string(listed.full ? "full" : "half") + " neighbor list of LAMMPS, because of " + why_listed +
      ": pairs that are not in it do not interact, special factors scale phi and w";
}

double PairPsi::init_one(int i, int j)
{
  if (setflag[i][j] == 0)
    stop("no coefficients for types " + std::to_string(i) + " and " + std::to_string(j) +
         ": this style does not mix them, set them with pair_coeff");
  refresh();
  exclusions.ask(i, j);
  return (*style)->facts().cutoff;
}

// Writes the present temperature, which may have changed since pair_style gave it.
void PairPsi::write_restart_settings(FILE *fp)
{
  auto now = given.arguments;
  if (!now.empty()) now[0] = exact(given.temperature);
  write_texts(fp, now);
}

void PairPsi::read_restart_settings(FILE *fp)
{
  auto texts = read_texts(fp, lmp);
  std::vector<char *> words;
  for (auto &text : texts) words.push_back(&text[0]);
  settings(static_cast<int>(words.size()), words.data());
}

void PairPsi::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  write_texts(fp, coefficients());
}

void PairPsi::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  if (!allocated) allocate();
  restore(read_texts(fp, lmp));
}

double PairPsi::memory_usage()
{
  double bytes = Pair::memory_usage();
  bytes += listed.bytes() + special.bytes() + exclusions.bytes() + ghost_reach.bytes() + exchange.vectors.capacity() * sizeof(double);
  if (style) bytes += static_cast<double>((*style)->memory());
  return bytes;
}
