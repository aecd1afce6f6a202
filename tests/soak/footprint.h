// What a process takes of memory and descriptors, and whether that stays.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <vector>

namespace gonio::soak {

struct Footprint {
    double minute = 0, resident_mib = 0;
    double anonymous_mib =
        0;  // of it what the process wrote itself; pages of libraries come and go with the machine's memory
    std::size_t descriptors = 0;
};

Footprint footprint(pid_t pid, double minute);

// Resident memory early, when all caches are full, and late, MiB: medians, since the largest files are loaded in few
// samples.
struct Growth {
    double early_mib = 0, late_mib = 0;
    double ratio() const { return early_mib > 0 ? late_mib / early_mib - 1 : 0; }
};
struct Span {
    double from, to;  // minutes
};
// Result: zeros where a span has no sample.
Growth growth_of(const std::vector<Footprint>& samples, const Span& early, const Span& late);

}  // namespace gonio::soak
