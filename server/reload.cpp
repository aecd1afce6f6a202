#include "server/reload.h"

#include <spdlog/spdlog.h>

#include "server/front_options.h"

namespace gonio {

void set_log_level(const Options& options) {
    spdlog::set_level(spdlog::level::from_str(options.log_level));
}

void reload(const Options& options, Front& front) {
    int ignored = 0;
    if (const auto now = parse_options(options.arguments, ignored))
        set_log_level(*now);
    else
        spdlog::warn("reload: the options are wrong now; the log level stays");
    std::string warning;
    if (const auto tokens = read_tokens(options, &warning); !tokens)
        spdlog::error("reload: the old tokens stay: {}", tokens.error().text());
    else
        front.set_tokens(*tokens);
    if (!warning.empty()) spdlog::warn("{}", warning);
    if (const auto loaded = front.reload_tls(); !loaded)
        spdlog::error("reload: the old certificate stays: {}", loaded.error().text());
    spdlog::info("reloaded");
}

}  // namespace gonio
