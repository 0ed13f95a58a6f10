// Traces dumped rays with Embree on one thread. Driven by crates/lab/src/kernel/embree.rs, which writes the
// file named by the first argument (little-endian: triangles u32, rays u32, nearest t f32; nine f32 a triangle;
// origin, direction, our t as seven f32 a ray, our t < 0 where we hit nothing). The second configures Embree: "isa=avx2".
//
// Each line on standard input, "medium fast 1" or "high robust 8" …, is answered by one line: rays per second, rays that hit
// farther from our t than the tolerance, rays of ours that hit and that Embree loses.
#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <time.h>
#include <xmmintrin.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace {

struct Ray {
    float origin[3], direction[3], t;
};

struct Dump {
    float nearest = 0;
    std::vector<float> vertices;
    std::vector<Ray> rays;
};

[[noreturn]] void fail(const char* what) {
    std::fprintf(stderr, "compare: %s\n", what);
    std::exit(1);
}

Dump read(const char* path) {
    std::ifstream file(path, std::ios::binary);
    std::uint32_t counts[2];
    Dump dump;
    file.read(reinterpret_cast<char*>(counts), sizeof counts);
    file.read(reinterpret_cast<char*>(&dump.nearest), sizeof dump.nearest);
    if (!file) fail("the dump has no header");
    dump.vertices.resize(std::size_t{9} * counts[0]);
    file.read(reinterpret_cast<char*>(dump.vertices.data()), std::streamsize(dump.vertices.size() * sizeof(float)));
    dump.rays.resize(counts[1]);
    file.read(reinterpret_cast<char*>(dump.rays.data()), std::streamsize(dump.rays.size() * sizeof(Ray)));
    if (!file) fail("the dump is cut off");
    return dump;
}

RTCScene build(RTCDevice device, const Dump& dump, RTCBuildQuality quality, RTCSceneFlags flags) {
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, flags);
    rtcSetSceneBuildQuality(scene, quality);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const std::size_t corners = dump.vertices.size() / 3;
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             3 * sizeof(float), corners);
    std::memcpy(vertices, dump.vertices.data(), dump.vertices.size() * sizeof(float));
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), corners / 3));
    for (std::size_t i = 0; i < corners; i++) indices[i] = std::uint32_t(i);
    rtcSetGeometryBuildQuality(geometry, quality);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) fail("Embree cannot build the scene");
    return scene;
}

// Rays as Embree takes them, W at a time, laid out before any clock runs: what is timed is a copy of each
// packet, which tracing overwrites, and the tracing.
template <int W>
struct Packet;

template <>
struct Packet<1> {
    using Type = RTCRayHit;
    static void trace(RTCScene scene, RTCIntersectContext* context, const int*, Type* packet) {
        rtcIntersect1(scene, context, packet);
    }
};

template <>
struct Packet<8> {
    using Type = RTCRayHit8;
    static void trace(RTCScene scene, RTCIntersectContext* context, const int* valid, Type* packet) {
        rtcIntersect8(valid, scene, context, packet);
    }
};

template <>
struct Packet<16> {
    using Type = RTCRayHit16;
    static void trace(RTCScene scene, RTCIntersectContext* context, const int* valid, Type* packet) {
        rtcIntersect16(valid, scene, context, packet);
    }
};

// The W numbers of one field of a packet: a float where W is 1, else an array.
float* lanes(float& one) { return &one; }
float* lanes(float* many) { return many; }
unsigned* lanes(unsigned& one) { return &one; }
unsigned* lanes(unsigned* many) { return many; }

template <int W>
std::vector<typename Packet<W>::Type> pack(const Dump& dump) {
    std::vector<typename Packet<W>::Type> packets(dump.rays.size() / W);
    for (std::size_t p = 0; p < packets.size(); p++) {
        auto& packet = packets[p];
        std::memset(&packet, 0, sizeof packet);
        for (int lane = 0; lane < W; lane++) {
            const Ray& ray = dump.rays[p * W + std::size_t(lane)];
            lanes(packet.ray.org_x)[lane] = ray.origin[0];
            lanes(packet.ray.org_y)[lane] = ray.origin[1];
            lanes(packet.ray.org_z)[lane] = ray.origin[2];
            lanes(packet.ray.dir_x)[lane] = ray.direction[0];
            lanes(packet.ray.dir_y)[lane] = ray.direction[1];
            lanes(packet.ray.dir_z)[lane] = ray.direction[2];
            lanes(packet.ray.tnear)[lane] = dump.nearest;
            lanes(packet.ray.tfar)[lane] = std::numeric_limits<float>::infinity();
            lanes(packet.ray.mask)[lane] = ~0u;
            lanes(packet.hit.geomID)[lane] = RTC_INVALID_GEOMETRY_ID;
        }
    }
    return packets;
}

// Processor time of this thread [s]: what else runs on the machine does not count.
double seconds() {
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

struct Answer {
    double rate;
    std::uint64_t differ, lost;
};

template <int W>
Answer trace(RTCScene scene, const Dump& dump) {
    alignas(64) int valid[W];
    for (int& lane : valid) lane = -1;
    const auto packets = pack<W>(dump);
    std::vector<float> t(dump.rays.size());
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);

    const double start = seconds();
    for (std::size_t p = 0; p < packets.size(); p++) {
        alignas(64) typename Packet<W>::Type packet = packets[p];
        Packet<W>::trace(scene, &context, valid, &packet);
        std::memcpy(&t[p * W], lanes(packet.ray.tfar), W * sizeof(float));
    }
    const double elapsed = seconds() - start;

    Answer answer{double(packets.size() * W) / elapsed, 0, 0};
    for (std::size_t i = 0; i < packets.size() * W; i++) {
        const float ours = dump.rays[i].t;
        // Nearer than Embree was told to look, there is nothing to compare.
        if (ours >= 0 && ours < 2 * dump.nearest) continue;
        const bool hit = std::isfinite(t[i]);
        if (ours >= 0 && !hit) answer.lost++;
        else if (hit && (ours < 0 || std::abs(t[i] - ours) > 8 * dump.nearest + 1e-3f * ours)) answer.differ++;
    }
    return answer;
}

Answer trace(const std::string& width, RTCScene scene, const Dump& dump) {
    if (width == "1") return trace<1>(scene, dump);
    if (width == "8") return trace<8>(scene, dump);
    if (width == "16") return trace<16>(scene, dump);
    fail("widths are 1, 8 and 16");
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) fail("usage: compare DUMP CONFIGURATION");
    // As Embree's manual asks for.
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    const Dump dump = read(arguments[1]);
    RTCDevice device = rtcNewDevice(arguments[2]);
    if (!device) fail("Embree cannot start");
    std::map<std::string, RTCScene> scenes;
    for (const auto& [name, quality] : {std::pair{"medium", RTC_BUILD_QUALITY_MEDIUM},
                                       std::pair{"high", RTC_BUILD_QUALITY_HIGH}}) {
        scenes[name + std::string(" fast")] = build(device, dump, quality, RTC_SCENE_FLAG_NONE);
        scenes[name + std::string(" robust")] = build(device, dump, quality, RTC_SCENE_FLAG_ROBUST);
    }
    std::printf("%ld %ld %ld\n", long(rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION)),
                long(rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)),
                long(rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)));
    std::fflush(stdout);
    std::string quality, mode, width;
    while (std::cin >> quality >> mode >> width) {
        const Answer answer = trace(width, scenes.at(quality + " " + mode), dump);
        std::printf("%.1f %llu %llu\n", answer.rate, static_cast<unsigned long long>(answer.differ),
                    static_cast<unsigned long long>(answer.lost));
        std::fflush(stdout);
    }
    for (const auto& named : scenes) rtcReleaseScene(named.second);
    rtcReleaseDevice(device);
}
