#include "server/http/tokens.h"

namespace gonio {

Right Tokens::right_of(std::string_view given) const {
    if (!asked()) return Right::change;
    const bool changes = equal_in_constant_time(given, all), looks = equal_in_constant_time(given, viewer);
    return changes ? Right::change : looks && !viewer.empty() ? Right::look : Right::none;
}

bool equal_in_constant_time(std::string_view given, std::string_view secret) {
    volatile unsigned difference = given.size() == secret.size() ? 0 : 1;
    for (std::size_t i = 0; i < given.size(); ++i) {
        const auto a = static_cast<unsigned char>(given[i]);
        const auto b = static_cast<unsigned char>(secret.empty() ? 0 : secret[i % secret.size()]);
        difference = difference | (a ^ b);
    }
    return difference == 0;
}

}  // namespace gonio
