// The source table of the consoles and the patch as people read them. Pure functions.
#pragma once

#include <string>

#include "protocol/schema/gonio.pb.h"

namespace gonio {

// Result: a line for each place that is listened at, then one for each sender and universe: who wins, what it sends.
std::string sources_table(const v1::Sources& sources);

}  // namespace gonio
