// The instruction set of what a CPU computes of light: Highway's targets and Embree's.
#pragma once

#include <string>

#include "ies/core/result.h"

namespace gonio::lighting {

// From now on only this one: "avx2" or "avx512"; "auto": the machine's best. Before anything is computed, and before
// any other thread. Errors: "unsupported" where the machine has it not.
Result<bool> use_isa(const std::string& name);

// Result: what is used: "avx2" or "avx512"; of older machines as Highway names it.
std::string isa_in_use();

}  // namespace gonio::lighting
