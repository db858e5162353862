/* A pair style with a table of coefficients over pairs of types. */

#ifndef PSIDPD_PAIR_TABLE_H
#define PSIDPD_PAIR_TABLE_H

#include "pair_psi.h"

namespace psidpd {

class PairTable : public PairPsi {
 public:
  // Takes the names of the coefficients, at most seven, in the order of pair_coeff; the last of them, which are `optional`, are 0 if
  // left out.
  PairTable(LAMMPS_NS::LAMMPS *lmp, const char *name, std::vector<std::string> names, size_t optional = 0);
  ~PairTable() override;

  void coeff(int narg, char **arg) override;
  void *extract(const char *what, int &dim) override;
  void write_data(FILE *fp) override;
  void write_data_all(FILE *fp) override;

 protected:
  void read_settings(int narg, char **arg) override;
  bool is_stale() override;
  std::vector<std::string> coefficients() override;
  void restore(const std::vector<std::string> &texts) override;

  // Throws an error if the coefficients of one pair are invalid.
  virtual void check(const Coefficients &given) = 0;
  virtual rust::Box<Style> make_from(double kt, rust::Slice<const Coefficients> pairs) = 0;
  rust::Box<Style> make_style(double kt) final;

  double cutoff = 0.0;

 private:
  std::string words(int i, int j) const;
  std::vector<Coefficients> table() const;
  std::vector<Coefficients> without_gaps(std::vector<Coefficients> pairs) const;

  const std::vector<std::string> names;
  const size_t needed;
  // One table of types for each coefficient; fix adapt changes its entries.
  std::vector<double **> value;
  std::vector<Coefficients> built;
};

}    // namespace psidpd

#endif
