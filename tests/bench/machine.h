// gonio-bench machine: what the machine itself can do, to measure the renderer's passes against.
#pragma once

#include <iosfwd>
#include <vector>

#include "server/gl/context.h"
#include "tests/bench/ray_rates.h"

namespace gonio::bench {

struct MachineRates {
    unsigned threads = 0;
    double flops_per_s = 0.0;    // multiply-adds of 32-bit floats in registers, two operations each, all threads
    double bytes_per_s = 0.0;    // a[i] = b[i] + s·c[i] over arrays far larger than the caches, three accesses
    double links_per_s = 0.0;    // surfels looked up and summed (server/transport/table.h), all threads
    std::vector<RayRates> rays;  // in cornell and in atrium
    double encoder_ms = 0.0;     // of one thread for a frame of cornell, 800 × 800, as one viewer has it; median
};
// Takes a few seconds; each rate is the best of several runs. Thread: the context's, which renders what is encoded.
MachineRates measure_machine(const gl::Context& context);
void print_machine(const MachineRates& rates, bool json, std::ostream& out);

}  // namespace gonio::bench
