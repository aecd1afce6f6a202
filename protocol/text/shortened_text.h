// Names from clients and files, for messages and logs.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace gonio {

// Result: at most so many bytes of the text, cut between characters; control characters and what is not UTF-8 become
// '?'; it ends at the first zero.
std::string shortened_text(std::string_view text, std::size_t most);

}  // namespace gonio
