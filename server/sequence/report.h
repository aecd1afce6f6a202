// How far a sequence is: a bar on a terminal, else a line of JSON for each event on stdout (docs/sequences.md).
#pragma once

#include <cstdint>
#include <string>

#include "server/sequence/manifest.h"

namespace gonio::sequence {

class Report {
public:
    // json: lines even where stderr is a terminal. of: the frames of this shard, all of which `kept` are there already.
    Report(bool json, int of, int kept);
    void begin(const Maker& maker, int frames) const;
    void kept(const Entry& entry);
    void written(const Entry& entry, double seconds);
    void video(const Entry& entry, bool kept) const;
    void waiting(int frames) const;  // other shards' frames that are not there yet
    void refused(const std::string& place, const Error& error) const;
    void end(int exit_code) const;

private:
    void show_bar(int done) const;
    double seconds_left() const;  // -1: not known

    bool bar_;
    int of_, done_ = 0, written_ = 0, to_write_;
    std::int64_t began_ns_;
};

}  // namespace gonio::sequence
