#include "server/app/log.h"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>

#include <spdlog/formatter.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "protocol/text/text_bytes.h"

namespace gonio {
namespace {

long long since_1970_ms(std::chrono::system_clock::time_point time) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

struct JsonLines : spdlog::formatter {
    void format(const spdlog::details::log_msg& entry, spdlog::memory_buf_t& line) override {
        const auto level = spdlog::level::to_string_view(entry.level);
        const std::string text = log_line_json(since_1970_ms(entry.time), {level.data(), level.size()},
                                               {entry.payload.data(), entry.payload.size()}) +
                                 "\n";
        line.append(text.data(), text.data() + text.size());
    }
    std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<JsonLines>(); }
};

std::string one_line(std::string_view text) {
    return printable_text({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

struct TextLines : spdlog::formatter {
    spdlog::pattern_formatter pattern;
    void format(const spdlog::details::log_msg& entry, spdlog::memory_buf_t& line) override {
        const std::string text = one_line({entry.payload.data(), entry.payload.size()});
        spdlog::details::log_msg shown = entry;
        shown.payload = text;
        pattern.format(shown, line);
    }
    std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<TextLines>(); }
};

}  // namespace

std::string log_line_json(long long time_ms, const std::string& level, const std::string& message) {
    const std::time_t seconds = time_ms / 1000;
    std::tm utc{};
    ::gmtime_r(&seconds, &utc);
    char time[32], whole[48];
    std::strftime(time, sizeof time, "%FT%T", &utc);
    std::snprintf(whole, sizeof whole, "%s.%03dZ", time, static_cast<int>(time_ms % 1000));
    const nlohmann::ordered_json entry{{"time", whole}, {"level", level}, {"message", message}};
    return entry.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void start_log(const Options& options) {
    auto logger = spdlog::stderr_logger_mt("goniod");
    if (options.log == "json")
        logger->set_formatter(std::make_unique<JsonLines>());
    else
        logger->set_formatter(std::make_unique<TextLines>());
    spdlog::set_default_logger(std::move(logger));
    set_log_level(options.log_level);
}

void set_log_level(const std::string& level) {
    spdlog::set_level(spdlog::level::from_str(level));
}

void log_end(const Options& options, const std::string& why) {
    const auto now_ms = since_1970_ms(std::chrono::system_clock::now());
    const std::string line =
        options.log == "json" ? log_line_json(now_ms, "critical", why) : "goniod: " + one_line(why);
    std::fprintf(stderr, "%s\n", line.c_str());
}

}  // namespace gonio
