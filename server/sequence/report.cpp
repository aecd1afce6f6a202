#include "server/sequence/report.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "server/base/clock.h"
#include "server/base/print_refusal.h"

namespace gonio::sequence {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr int kBarCharacters = 30;

void print_line(const OrderedJson& json) {
    std::printf("%s\n", json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace).c_str());
    std::fflush(stdout);
}

double rounded(double seconds) {
    return std::round(seconds * 1000.0) / 1000.0;
}

// "1:02:03", "2:03".
std::string print_duration(double seconds) {
    const auto whole = static_cast<long long>(std::ceil(seconds));
    char text[48];
    if (whole >= 3600)
        std::snprintf(text, sizeof text, "%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60, whole % 60);
    else
        std::snprintf(text, sizeof text, "%lld:%02lld", whole / 60, whole % 60);
    return text;
}

OrderedJson frame_line(const char* state, const Entry& entry) {
    return {{"event", "frame"},   {"state", state},         {"frame", entry.frame},
            {"name", entry.name}, {"sha256", entry.sha256}, {"bytes", entry.bytes}};
}

}  // namespace

Report::Report(bool json, int of, int kept)
    : bar_(!json && isatty(STDERR_FILENO) != 0), of_(of), to_write_(of - kept), began_ns_(monotonic_ns()) {}

void Report::begin(const Maker& maker, int frames) const {
    if (bar_) return show_bar(of_ - to_write_);
    print_line({{"event", "begin"},
                {"frames", frames},
                {"of_shard", of_},
                {"kept", of_ - to_write_},
                {"job", maker.job},
                {"version", maker.version},
                {"isa", maker.isa},
                {"cpu", maker.cpu}});
}

void Report::kept(const Entry& entry) {
    ++done_;
    if (bar_) return;
    OrderedJson line = frame_line("kept", entry);
    line["done"] = done_;
    line["of"] = of_;
    print_line(line);
}

void Report::written(const Entry& entry, double seconds) {
    ++done_;
    ++written_;
    if (bar_) return show_bar(done_);
    OrderedJson line = frame_line("written", entry);
    line["seconds"] = rounded(seconds);
    line["done"] = done_;
    line["of"] = of_;
    line["left_s"] = rounded(seconds_left());
    print_line(line);
}

void Report::video(const Entry& entry, bool kept) const {
    if (bar_) {
        std::fprintf(stderr, "\r\033[K%s\n", entry.name.c_str());
        return;
    }
    print_line({{"event", "video"},
                {"state", kept ? "kept" : "written"},
                {"name", entry.name},
                {"sha256", entry.sha256},
                {"bytes", entry.bytes}});
}

void Report::waiting(int frames) const {
    if (bar_) {
        std::fprintf(stderr, "\r\033[K%d frames of other shards are not there yet\n", frames);
        return;
    }
    print_line({{"event", "waiting"}, {"frames", frames}});
}

void Report::refused(const std::string& place, const Error& error) const {
    if (bar_) std::fputs("\r\033[K", stderr);
    if (!bar_)
        print_line({{"event", "error"},
                    {"place", place},
                    {"code", error.code},
                    {"where", error.where},
                    {"value", error.value},
                    {"message", error.message}});
    print_refusal(place, error);
}

void Report::end(int exit_code) const {
    const double seconds = seconds_since(began_ns_);
    if (bar_) {
        std::fprintf(stderr, "\r\033[K%d of %d frames, %d made in %s\n", done_, of_, written_,
                     print_duration(seconds).c_str());
        return;
    }
    print_line({{"event", "end"},
                {"exit_code", exit_code},
                {"done", done_},
                {"of", of_},
                {"written", written_},
                {"seconds", rounded(seconds)}});
}

double Report::seconds_left() const {
    if (written_ == 0) return -1.0;
    return seconds_since(began_ns_) / written_ * (to_write_ - written_);
}

void Report::show_bar(int done) const {
    const int filled = of_ > 0 ? kBarCharacters * done / of_ : kBarCharacters;
    const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                            std::string(static_cast<std::size_t>(kBarCharacters - filled), '.');
    std::string text = "[" + bar + "] " + std::to_string(done) + "/" + std::to_string(of_);
    if (written_ > 0) {
        char rate[32];
        std::snprintf(rate, sizeof rate, "  %.2f frames/s", written_ / std::max(1e-9, seconds_since(began_ns_)));
        text += rate + ("  " + print_duration(seconds_left()) + " left");
    }
    std::fprintf(stderr, "\r\033[K%s", text.c_str());
    std::fflush(stderr);
}

}  // namespace gonio::sequence
