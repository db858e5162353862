/* The pair style that psidpd's styles share: an engine of the model, and LAMMPS around it. */

#ifndef PSIDPD_PAIR_PSI_H
#define PSIDPD_PAIR_PSI_H

#include "pair.h"
#include "psidpd-lammps/src/bridge.rs.h"

#include <optional>
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
  void init_style() override;
  double init_one(int i, int j) override;

  int pack_forward_comm(int n, int *list, double *buf, int pbc_flag, int *pbc) override;
  void unpack_forward_comm(int n, int first, double *buf) override;
  double memory_usage() override;

 protected:
  // Builds the engine, if it is not there yet; called by init_style.
  virtual void build_style() {}

  void allocate();
  // Temperature and seed of pair_style, checked.
  void read_temperature(const char *arg);
  void read_seed(const char *arg);
  // Stops with "Pair style NAME: text", on all ranks.
  [[noreturn]] void stop(const std::string &text);

  const std::string name;
  double kt = 0.0;
  uint64_t seed = 0;
  std::optional<rust::Box<Style>> style;

 private:
  void check_host();
  void check_box();
  void check_ghosts();

  bool described = false;
};

}    // namespace psidpd

#endif
