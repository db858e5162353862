#include "ghost_exchange.h"

using namespace psidpd;

int GhostExchange::pack(int n, const int *list, double *buf, int pbc_flag, const int *pbc, const double *slopes,
                        size_t width)
{
  switch (carries) {
    case Carries::images:
      images.pack(n, list, buf, pbc_flag, pbc);
      return n;
    case Carries::vectors:
      for (int i = 0; i < n; i++) buf = std::copy_n(&vectors[3 * static_cast<size_t>(list[i])], 3, buf);
      return 3 * n;
    case Carries::slopes:
      for (int i = 0; i < n; i++) buf = std::copy_n(slopes + list[i] * width + first_column, columns, buf);
      return n * columns;
  }
  return 0;
}

void GhostExchange::unpack(int n, int first, const double *buf, double *slopes, size_t width)
{
  switch (carries) {
    case Carries::images:
      images.unpack(n, first, buf);
      return;
    case Carries::vectors:
      std::copy_n(buf, 3 * n, vectors.begin() + 3 * static_cast<size_t>(first));
      return;
    case Carries::slopes:
      for (int i = first; i < first + n; i++, buf += columns)
        std::copy_n(buf, columns, slopes + i * width + first_column);
  }
}
