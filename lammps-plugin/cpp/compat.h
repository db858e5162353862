/* What differs between the versions of LAMMPS that these styles compile against. */

#ifndef PSIDPD_COMPAT_H
#define PSIDPD_COMPAT_H

#include "comm.h"
#include "pair.h"

namespace psidpd {

// forward_comm(Pair *) was called forward_comm_pair before 2022.
template <class Comm>
auto forward_slopes(Comm *comm, LAMMPS_NS::Pair *pair, int) -> decltype(comm->forward_comm(pair), void())
{
  comm->forward_comm(pair);
}

template <class Comm>
auto forward_slopes(Comm *comm, LAMMPS_NS::Pair *pair, long) -> decltype(comm->forward_comm_pair(pair), void())
{
  comm->forward_comm_pair(pair);
}

}    // namespace psidpd

#endif
