// Text in columns.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace gonio {

using Cells = std::vector<std::string>;  // of a row, UTF-8

// Result: a line for each row. Every column but the last is as wide as its widest cell, in characters; two blanks part
// columns, and none ends a line.
std::string aligned(std::span<const Cells> rows);

}  // namespace gonio
