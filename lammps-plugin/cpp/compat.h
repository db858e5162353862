/* What differs between the versions of LAMMPS that these styles compile against. */

#ifndef PSIDPD_COMPAT_H
#define PSIDPD_COMPAT_H

#include "comm.h"
#include "neighbor.h"
#include "pair.h"

#if __has_include("neigh_request.h")
#include "neigh_request.h"
#endif

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

// add_request(Pair *, flags), flag 1 for a full list, was request(Pair *, instance) before 2022.
template <class Neighbor>
auto request_full_list(Neighbor *neighbor, LAMMPS_NS::Pair *pair, int, int)
    -> decltype(neighbor->add_request(pair, 1), void())
{
  neighbor->add_request(pair, 1);
}

template <class Neighbor>
auto request_full_list(Neighbor *neighbor, LAMMPS_NS::Pair *pair, int instance, long)
    -> decltype(neighbor->request(pair, instance), void())
{
  const int k = neighbor->request(pair, instance);
  neighbor->requests[k]->half = 0;
  neighbor->requests[k]->full = 1;
}

}    // namespace psidpd

#endif
