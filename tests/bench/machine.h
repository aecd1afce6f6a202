// gonio-bench machine: what the machine itself can do, to measure the renderer's passes against.
#pragma once

#include <iosfwd>

namespace gonio::bench {

struct MachineRates {
    unsigned threads = 0;
    double flops_per_s = 0.0;  // multiply-adds of 32-bit floats in registers, two operations each, all threads
    double bytes_per_s = 0.0;  // a[i] = b[i] + s·c[i] over arrays far larger than the caches, three accesses
    double vpl_evaluations_per_s = 0.0;  // of the gather's kernel (server/shade/kernels.h), all threads
};
// Takes about a second. Each rate is the best of several runs.
MachineRates measure_machine();
void print_machine(const MachineRates& rates, bool json, std::ostream& out);

}  // namespace gonio::bench
