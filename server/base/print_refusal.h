#pragma once

#include <cstdio>
#include <string>

#include "ies/core/result.h"

namespace gonio {

// Says on stderr what goniod's job could not do. place: the option, the field of the job, or the file.
inline void print_refusal(const std::string& place, const Error& error) {
    std::fprintf(stderr, "goniod: %s: %s: %s\n", place.c_str(), error.code.c_str(), error.text().c_str());
}

}  // namespace gonio
