// `intervale build` under mpirun: a program of its own, so that nobody else loads MPI.
#pragma once

namespace intervale {

// Of `build`, and as one of several ranks: becomes intervale-mpi, which lies beside this program or in the libexec of
// where it is installed, and does not return. If it is not there, rank 0 says so, and the process ends with the status
// of a failure. Otherwise does nothing.
void become_mpi_program(int argc, char** argv);

}  // namespace intervale
