// `goniod --doctor`: what would keep this machine from working, each with its mend. Changes nothing.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/app/options.h"

namespace gonio {

struct Finding {
    enum class State { ok, warning, fault };  // warning: it works, with less than it could; fault: it does not start
    // "options", "egl", "gpu", "encoder", "pictures", "port", "device", "time", "buffer", "descriptors", "leader"
    std::string check;
    State state = State::ok;
    std::string found;  // a sentence
    std::string mend;   // what to do; empty where all is well
};

// What the checks ask of the machine; tests put in another one.
struct Machine {
    std::string root;                                         // before /dev, /proc and the folders of udev's rules
    std::function<bool(const std::string&)> may_use;          // whether this user may read and write the file
    std::function<std::string(const std::string&)> group_of;  // of a file, its name; empty: that has none
    std::function<bool(const std::string&)> group_may_use;    // whether this group may read and write the file
    std::function<int()> clock_state;          // adjtimex(2): TIME_ERROR where nothing keeps the clock right
    std::function<long long()> receive_bytes;  // that a socket of the consoles gets
    static Machine real();
};

// Errors of the configuration file and of options that depend on each other or on files, which else end with 78.
std::vector<Finding> check_options(const Options& options);
// The parts that need no GL. Result: a finding for each thing that was looked at, at least one.
std::vector<Finding> check_ports(const Options& options);
std::vector<Finding> check_devices(const Options& options, const Machine& machine);
Finding check_time(const Machine& machine);
Finding check_buffers(const Options& options, const Machine& machine);
// With --follow.
Finding check_leader(const Options& options);
Finding check_descriptors(const Options& options, unsigned long long may_open);

// Result: a line for each finding and one for its mend; or --log json: an object a line,
// {"check","state","found","mend"}.
std::string findings_text(const std::vector<Finding>& findings, bool json);

// Examines all with these options and prints it. Result: the exit code, 1 where there is a fault.
int run_doctor(const Options& options);

}  // namespace gonio
