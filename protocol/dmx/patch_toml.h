// A patch file (TOML, docs/consoles.md) <-> SetPatch. Pure; toml++ stays in the .cpp file.
#pragma once

#include <string>
#include <string_view>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

inline constexpr std::size_t kMaxPatchFileBytes = 1u << 20;  // more is refused: "too_large"

// Result: the patch, its rows checked. Errors: "bad_patch" with "line L column C" as place and the offending value;
// "too_large".
Result<v1::SetPatch> read_patch_toml(std::string_view text);
// Result: a file that reads back as the same rows.
std::string write_patch_toml(const v1::Patch& patch);

}  // namespace gonio
