// A promise of a fuzz target or of its replay test: one that is broken ends the run.
#pragma once

#include <cstdlib>

#include "ies/core/result.h"

namespace gonio::fuzz {

inline void require(bool promise) {
    if (!promise) std::abort();
}

inline void check_refusal(const Error& error) {
    require(!error.code.empty() && !error.message.empty());
}

}  // namespace gonio::fuzz
