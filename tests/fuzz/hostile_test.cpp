// Inputs that someone made to do harm, one by one: what chance does not find.

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

#include "host/error.h"
#include "host/io/checkpoint.h"
#include "host/io/file_bytes.h"
#include "host/io/json_node.h"
#include "host/io/npz.h"
#include "host/io/torch_archive.h"
#include "host/io/zip_archive.h"
#include "model/body/makehuman_files.h"
#include "model/config.h"
#include "model/data/dreams_calibration.h"
#include "model/data/smplx_parameters.h"
#include "model/train/evaluation_folder.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
using namespace std::string_literals;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// Is the file refused by an Error that holds `reason`, with no fault (fuzz.h) besides?
void check_refused(const std::string& name, const Bytes& bytes, const std::function<void(const fs::path&)>& read,
                   const std::string& reason) {
  const TemporaryFolder folder;
  write_folder({{name, bytes}}, folder.path());
  bool was_refused = false;
  CHECK(fault_of({name, {}, {}, read}, folder / name, &was_refused) == "");
  CHECK(was_refused);
  CHECK_THROWS_WITH(read(folder / name), Contains(reason));
}

Bytes npy_of(const std::string& header, size_t data_bytes = 0) {
  std::string file = "\x93NUMPY\x01\x00"s;
  file += static_cast<char>(header.size() & 255);
  file += static_cast<char>(header.size() >> 8);
  return bytes_of(file + header + std::string(data_bytes, '\0'));
}

void read_array(const fs::path& path) {
  const NpyArray array = parse_npy(read_file_bytes(path), path.string());
  array.floats();
}

void read_torch(const fs::path& path) {
  read_torch_archive(path);
}

Bytes torch_of(const std::string& pickle, size_t storage_bytes = 16) {
  return make_zip(std::vector<ZipEntry>{{"x/data.pkl", bytes_of(pickle)}, {"x/data/0", Bytes(storage_bytes)}}, false);
}

std::string repeated(const std::string& text, size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (size_t i = 0; i < times; ++i) all += text;
  return all;
}

/// A little-endian number of so many bytes.
std::string number(uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
  return text;
}

/// A zip archive of one deflated entry "a.npy" of zeros.
Bytes zip_of_zeros(size_t bytes) {
  return make_zip(std::vector<ZipEntry>{{"a.npy", Bytes(bytes)}}, true);
}

}  // namespace

TEST_CASE("a small archive that unpacks to hundreds of megabytes is refused before it is unpacked") {
  const auto read = [](const fs::path& path) { ZipReader(path).read("a.npy"); };
  const Bytes bomb = zip_of_zeros(size_t{300} << 20);
  CHECK(bomb.size() < size_t{4} << 20);
  check_refused("bomb.npz", bomb, read, "claims 314572800 bytes");
  // Zeros as such are fine: bodies hold many.
  CHECK(ZipReader(zip_of_zeros(1 << 20), "fine").read("a.npy").size() == 1 << 20);
}

TEST_CASE("archives whose entries lie about their sizes are refused") {
  const auto read = [](const fs::path& path) { ZipReader(path).read("a.npy"); };
  Bytes archive = zip_of_zeros(5000);
  const std::string text(reinterpret_cast<const char*>(archive.data()), archive.size());
  const size_t directory = text.rfind("PK\x01\x02");
  for (const uint32_t size : {0u, 4999u, 5001u, 0x7fffffffu, 0xffffffffu}) {
    CAPTURE(size);
    Bytes lying = archive;
    std::memcpy(lying.data() + directory + 24, &size, sizeof(size));
    check_refused("lying.npz", lying, read, "lying.npz");
  }
}

TEST_CASE("archives with names that lead out of them are refused") {
  for (const char* name : {"../../x.npy", "/etc/passwd", "a/../../x.npy", "..", "a/..", "..\\x.npy", "C:\\x.npy"}) {
    CAPTURE(name);
    check_refused(
        "out.npz", make_zip(std::vector<ZipEntry>{{name, Bytes(3)}}, false),
        [](const fs::path& path) { NpzFile(path).keys(); }, "a path out of the archive");
  }
  CHECK(ZipReader(make_zip(std::vector<ZipEntry>{{"a/..b/c...npy", Bytes(3)}}, false), "fine").names().size() == 1);
}

TEST_CASE("arrays of absurd shapes are refused") {
  const auto header = [](const char* type, const char* shape) {
    return npy_of("{'descr': '"s + type + "', 'fortran_order': False, 'shape': " + shape + ", }\n");
  };
  check_refused("a.npy", header("<f4", "(-1,)"), read_array, "no whole number");
  check_refused("a.npy", header("<f4", "(9223372036854775807, 9223372036854775807)"), read_array, "is damaged");
  check_refused("a.npy", header("<f4", "(18446744073709551615,)"), read_array, "no whole number");
  check_refused("a.npy", header("<f4", "(0, 9223372036854775807, 9223372036854775807)"), read_array, "is damaged");
  // No bytes an element: any number of them would fit an empty file.
  check_refused("a.npy", header("<U0", "(4611686018427387904,)"), read_array, "not read");
  check_refused("a.npy", header("|S0", "(4611686018427387904,)"), read_array, "not read");
  check_refused("a.npy", header("|O", "(1,)"), read_array, "never unpickled");
}

TEST_CASE("pickles that call are refused by name, and nothing runs") {
  const TemporaryFolder folder;
  const std::string witness = (folder / "witness").string(), command = "touch " + witness;
  const std::string argument = "X" + number(command.size(), 4) + command + "\x85";
  for (const auto& [callee, name] : std::vector<std::pair<std::string, std::string>>{
           {"cos\nsystem\n", "'os.system'"},
           {"cposix\nsystem\n", "'posix.system'"},
           {"csubprocess\nPopen\n", "'subprocess.Popen'"},
           {"cbuiltins\nexec\n", "'builtins.exec'"},
           {"ctorch\nload\n", "'torch.load'"},
           {"\x8c\x02os\x8c\x06system\x93", "'os.system'"}}) {  // STACK_GLOBAL
    check_refused("evil.pt", torch_of("\x80\x02" + callee + argument + "R."), read_torch, name);
  }
  // INST, OBJ, NEWOBJ and extension codes, a Namespace that is more than a name for options, BUILD of what is no
  // dictionary, and a persistent value that is no storage.
  check_refused("evil.pt", torch_of("\x80\x02(" + argument + "ios\nsystem\n."), read_torch, "opcode 0x69");
  check_refused("evil.pt", torch_of("\x80\x02(ctorch\nFloatStorage\no."), read_torch, "opcode 0x6f");
  check_refused("evil.pt",
                torch_of("\x80\x02"
                         "ctorch\nFloatStorage\n)\x81."),
                read_torch, "storage type is called");
  check_refused("evil.pt",
                torch_of("\x80\x02"
                         "cos\nsystem\n" +
                         argument + "\x81."),
                read_torch, "'os.system'");
  check_refused("evil.pt",
                torch_of("\x80\x02"
                         "cargparse\nNamespace\n" +
                         argument + "\x81."),
                read_torch, "made of arguments");
  check_refused("evil.pt",
                torch_of("\x80\x02"
                         "cargparse\nNamespace\n}b."),
                read_torch, "not read at byte");
  check_refused("evil.pt", torch_of("\x80\x02\x82\x01."), read_torch, "opcode 0x82");
  check_refused("evil.pt",
                torch_of("\x80\x02"
                         "ctorch\nFloatStorage\n)R."),
                read_torch, "storage type is called");
  check_refused("evil.pt", torch_of("\x80\x02" + argument + "Q."), read_torch, "no tensor storage");
  CHECK_FALSE(fs::exists(witness));
}

TEST_CASE("pickles that nest, repeat or contain themselves end soon") {
  const size_t many = 4 << 20;
  check_refused("deep.pt", torch_of("\x80\x02" + repeated("]", many) + repeated("a", many - 1) + "."), read_torch,
                "opcodes");
  check_refused("wide.pt", torch_of("\x80\x02" + repeated("}", many) + "."), read_torch, "opcodes");
  // Tuples in tuples, within the limit on opcodes: nothing may descend into them.
  check_refused("tuples.pt", torch_of("\x80\x02N" + repeated("\x85", 100000) + "."), read_torch, "holds no tensor");
  // {"a": {"a": .. }}, 100 deep; a dictionary within itself; each of 20 twice in the one before: a million paths.
  const std::string key = "X\x01\0\0\0a"s;
  check_refused("chain.pt", torch_of("\x80\x02" + repeated("}" + key, 100) + "}" + repeated("s", 100) + "."),
                read_torch, "nested too deeply");
  check_refused("self.pt", torch_of("\x80\x02}q\x01" + key + "h\x01s."), read_torch, "nested too deeply");
  std::string doubling = "\x80\x02}q\x01";
  for (char i = 2; i < 22; ++i) {
    const std::string before{'h', static_cast<char>(i - 1)};
    doubling += "}q"s + i + key + before + "sX\x01\0\0\0b"s + before + "s";
  }
  check_refused("doubling.pt", torch_of(doubling + "."), read_torch, "nested too deeply");
  // A name of a megabyte, used again and again.
  const std::string name = "X" + number(1 << 20, 4) + std::string(1 << 20, 'n') + "q\x01";
  check_refused("long.pt", torch_of("\x80\x02}" + name + "}s" + repeated("h\x01}s", 1000) + "."), read_torch,
                "too long for a name");
}

TEST_CASE("a storage that a thousand tensors claim is refused") {
  const std::string tensor =
      "ctorch._utils\n_rebuild_tensor_v2\n((X\x07\0\0\0storagectorch\nFloatStorage\nX\x01\0\0\0"
      "0X\x03\0\0\0cpuJ"s +
      number(1 << 18, 4) + "tQK\0J"s + number(1 << 18, 4) + "\x85K\x01\x85\x89}tR";
  std::string pickle = "\x80\x02}X\x01\0\0\0t"s + tensor + "q\x01s";
  for (uint64_t i = 0; i < 1000; ++i) pickle += "X\x04\0\0\0"s + fmt::format("{:04}", i) + "h\x01s";
  check_refused("shared.pt", torch_of(pickle + ".", 1 << 20), read_torch, "many times over");
}

TEST_CASE("JSON that nests deeply or is all values is refused") {
  const size_t many = 1 << 20;
  const std::vector<std::pair<std::string, std::function<void(const fs::path&)>>> readers = {
      {"cameras.json", [](const fs::path& path) { read_dreams_cameras(path); }},
      {"rig.mhskel", [](const fs::path& path) { read_makehuman_rig(path, 8); }},
      {"config.json", [](const fs::path& path) { load_config(path); }},
      {"boxes.json", [](const fs::path& path) { EvaluationFolder(path.parent_path()).read_pictures(); }}};
  for (const auto& [name, read] : readers) {
    CAPTURE(name);
    check_refused(name, bytes_of(repeated("[", many)), read, name);
    check_refused(name, bytes_of(repeated("{\"a\":", many)), read, name);
    check_refused(name, bytes_of(repeated("[", many) + repeated("]", many)), read, "levels deep");
    // Where a section belongs: its text would be printed.
    check_refused(name, bytes_of("{\"net\": " + repeated("[", many) + repeated("]", many) + "}"), read, "levels deep");
    check_refused(name, bytes_of("\"" + std::string(many, 'x')), read, name);
  }
  const TemporaryFolder folder;
  write_folder({{"wide.json", bytes_of("[" + repeated("0,", 10'000'000) + "0]")}}, folder.path());
  CHECK_THROWS_WITH(read_json(folder / "wide.json"), Contains("wide.json: JSON of more than"));
  // Read in a time that grows with their number, not its square.
  write_folder({{"long.json", bytes_of("[" + repeated("{},", 500'000) + "{}]")}}, folder.path());
  CHECK(read_json(folder / "long.json").size() == 500'001);
}

TEST_CASE("checkpoints of negative, absurd or nested contents are refused") {
  const auto read = [](const fs::path& path) { read_checkpoint(path); };
  const auto checkpoint = [](const std::string& text) {
    return bytes_of("DEGASCKP" + number(1, 4) + number(text.size(), 8) + text);
  };
  for (const char* count : {"-1", "1e300", "18446744073709551615", "4611686018427387904", "null", "[]", "true"}) {
    CAPTURE(count);
    check_refused("c.bin", checkpoint("{\"header\": {}, \"arrays\": [[\"a\", "s + count + "]]}"), read, "c.bin");
  }
  const size_t many = 1 << 20;
  check_refused("c.bin", checkpoint("{\"header\": " + repeated("[", many) + repeated("]", many) + ", \"arrays\": []}"),
                read, "levels deep");
  check_refused("c.bin", bytes_of("DEGASCKP" + number(1, 4) + number(~uint64_t{0}, 8)), read, "cut short");
}

TEST_CASE("body parameters of absurd numbers of frames are refused before there is a pose of each") {
  const std::string header = "{'descr': '|u1', 'fortran_order': False, 'shape': (2000000, 3), }\n";
  const Bytes archive = make_zip(std::vector<ZipEntry>{{"global_orient.npy", npy_of(header, 6'000'000)}}, false);
  check_refused(
      "smplx.npz", archive, [](const fs::path& path) { read_smplx_parameters(path); }, "2000000 rows");
}

TEST_CASE("bones that share one long list of vertices are refused") {
  std::string rig = "{\"joints\": {\"j\": [0" + repeated(",0", 100'000) + "]}, \"bones\": {\"b\": {\"head\": \"j\"}";
  for (int i = 0; i < 1000; ++i) rig += fmt::format(",\"b{}\": {{\"head\": \"j\"}}", i);
  check_refused(
      "rig.mhskel", bytes_of(rig + "}}"), [](const fs::path& path) { read_makehuman_rig(path, 8); }, "name more than");
}

TEST_CASE("boxes at the ends of the integers are refused") {
  for (const char* edge : {"-2147483648", "2147483648", "-9223372036854775808", "18446744073709551615"}) {
    CAPTURE(edge);
    const std::string text = "[{\"camera\": \"a\", \"frame\": 0, \"refined\": false, \"person\": ["s + edge +
                             ", 0, 1, 1], \"face\": null, \"mouth\": null}]";
    check_refused(
        "boxes.json", bytes_of(text),
        [](const fs::path& path) { EvaluationFolder(path.parent_path()).read_pictures(); }, "a box has");
  }
}
