// What containers compiled by GCC 12 call and libstdc++ has not before GCC 11: a library with its own loads with libstdc++ of GCC 8
// too, as manylinux_2_28 promises.
#include <new>

namespace std {
[[noreturn]] void __throw_bad_array_new_length() { throw bad_array_new_length(); }
}
