/* Stands in for the fmt/format.h that some packages of LAMMPS's headers leave out. The headers name
   these in templates that the styles never use: declarations are enough. */

#ifndef PSIDPD_COMPAT_FMT_FORMAT_H
#define PSIDPD_COMPAT_FMT_FORMAT_H

#include <string>

namespace fmt {

struct string_view {
  string_view(const char *);
  string_view(const std::string &);
};

struct format_args {};

template <class... Args> format_args make_args_checked(...);
template <class... Args> format_args make_format_args(const Args &...);

}    // namespace fmt

#endif
