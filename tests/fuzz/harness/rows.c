#include "rows.h"

#include <math.h>
#include <string.h>

void fuzz_rows_start(struct rows_in *in, const uint8_t *data, size_t size) {
    memset(in, 0, sizeof *in);
    in->bytes = (struct bytes){data, size};
    in->consistent = in->raw_too = true;
}

void fuzz_rows_pool(struct rows_in *in) {
    in->pool_n = take_byte(&in->bytes);
    for (int64_t i = 0; i < in->pool_n; i++) {
        in->pool[i] = ((int)(i * 37 % 19) - 9) * 0.5;
    }
}

static void begin(struct rows_in *in, nc_block *row, int type) {
    memset(row, 0, sizeof *row);
    memcpy(row->end, in->position, sizeof row->end);
    row->type = (uint8_t)type;
    row->line = row->count = ++in->line;
}

static bool line(struct rows_in *in, nc_block *row, uint8_t kind) {
    double scale = kind & 16 ? 1.0 : kind & 32 ? 0.001 : 0.05;
    double sum = 0.0;
    begin(in, row, NC_LINEAR);
    uint8_t set = take_byte(&in->bytes);
    for (int i = 0; i < in->axes && i < 8; i++) {
        if (set >> i & 1) {
            double way = take_mm(&in->bytes) * scale;
            row->end[i] += way;
            sum += i < 3 ? way * way : 0.0;
        }
    }
    for (int i = 3; i < in->axes && sum == 0.0; i++) {
        sum += pow(row->end[i] - in->position[i], 2);
    }
    if (!(sum > 1e-12)) {
        return false;
    }
    row->length = row->length_min = sqrt(sum);
    row->feed = 0.1 + take_word(&in->bytes) / 100.0;
    if (kind & 64) {
        row->flags |= NC_RAPID;
        row->feed = 0.0;
    }
    if (kind & 128) {
        row->flags |= NC_EXACT_STOP;
    }
    memcpy(in->position, row->end, sizeof in->position);
    return true;
}

static bool circle(struct rows_in *in, nc_block *row, uint8_t kind) {
    begin(in, row, NC_CIRCULAR);
    double x = take_mm(&in->bytes) * (kind & 32 ? 0.002 : 0.1);
    double y = take_mm(&in->bytes) * 0.1;
    double radius = hypot(x, y);
    double angle = (int16_t)take_word(&in->bytes) / 5000.0;
    if (radius < 1e-4 || fabs(angle) < 1e-4) {
        return false;
    }
    double from = atan2(-y, -x);
    row->center[0] = in->position[0] + x;
    row->center[1] = in->position[1] + y;
    row->radius = row->programmed_radius = radius;
    row->angle = angle;
    row->plane = 17;
    row->end[0] = row->center[0] + radius * cos(from + angle);
    row->end[1] = row->center[1] + radius * sin(from + angle);
    double pitch = kind & 16 ? take_mm(&in->bytes) * 0.05 : 0.0;
    row->end[2] += pitch;
    row->length = row->length_min = hypot(radius * fabs(angle), pitch);
    row->feed = 0.1 + take_word(&in->bytes) / 100.0;
    if (kind & 128) {
        row->flags |= NC_EXACT_STOP;
    }
    memcpy(in->position, row->end, sizeof in->position);
    return true;
}

static void dynamics(struct rows_in *in, nc_block *row) {
    begin(in, row, NC_DYNAMICS);
    row->code = 1 + take_byte(&in->bytes) % 5;
    for (int i = 0; i < NC_AXES; i++) {
        row->end[i] = (1 + take_byte(&in->bytes)) / 256.0;
        if (row->code == NC_DYNAMICS_PATH) {
            row->end[i] *= 1000.0;
        }
    }
    row->value = take_byte(&in->bytes) % 2;
}

static void contour(struct rows_in *in, nc_block *row) {
    struct bytes *bytes = &in->bytes;
    begin(in, row, NC_CONTOUR);
    row->plane = take_byte(bytes) & 1;
    row->code = 1 + take_byte(bytes) % 7;
    row->degree = take_byte(bytes) % 3;
    row->flags = take_byte(bytes) & 1;
    row->value = take_byte(bytes) / 100.0;
    row->center[0] = take_signed(bytes) / 10.0;
    row->center[1] = take_signed(bytes) / 10.0;
    row->radius = take_byte(bytes) / 100.0;
    row->programmed_radius = take_byte(bytes) / 100.0;
    row->length_min = take_byte(bytes) / 100.0;
    row->feed = take_byte(bytes) / 255.0;
    row->angle = take_byte(bytes) / 80.0;
    row->length = take_byte(bytes) / 255.0;
}

static void smoothing(struct rows_in *in, nc_block *row) {
    struct bytes *bytes = &in->bytes;
    begin(in, row, NC_SMOOTHING);
    row->code = take_byte(bytes) & 1;
    row->value = take_byte(bytes) / 500.0;
    row->radius = take_byte(bytes) / 50.0;
    row->angle = take_byte(bytes) / 100.0;
    row->length = take_byte(bytes) / 10.0;
}

static void compensation(struct rows_in *in, nc_block *row, uint8_t kind) {
    static const uint32_t modes[] = {NC_OFFSET_DIRECT,
                                     NC_OFFSET_INDIRECT,
                                     NC_OFFSET_PERPENDICULAR,
                                     NC_OFFSET_WITHOUT_BLOCK,
                                     NC_OFFSET_TANGENTIAL};
    begin(in, row, NC_COMPENSATION);
    row->code = 40 + take_byte(&in->bytes) % 3;
    row->value = take_signed(&in->bytes) / 10.0;
    row->plane = 17;
    row->pool = modes[take_byte(&in->bytes) % 5];
    row->degree = NC_OFFSET_LINES + (kind >> 4 & 1);
}

static void place(struct rows_in *in, nc_block *row, uint8_t kind) {
    begin(in,
          row,
          kind & 16   ? NC_DISTANCE_RESET
          : kind & 32 ? NC_S
          : kind & 64 ? NC_H
                      : NC_EVENT);
    row->code = take_byte(&in->bytes) % 12;
    row->value = take_number(&in->bytes);
    if (kind & 128) {
        row->flags |= NC_STANDSTILL;
    }
}

/* Any numbers; a coefficient place may lie outside the pool. */
static bool raw(struct rows_in *in, nc_block *row) {
    struct bytes *bytes = &in->bytes;
    if (!in->raw_too) {
        return false;
    }
    in->consistent = false;
    begin(in, row, take_byte(bytes) % 26);
    for (int i = 0; i < in->axes; i++) {
        if (take_byte(bytes) & 1) {
            row->end[i] = take_number(bytes);
        }
    }
    double *numbers[] = {&row->length,
                         &row->feed,
                         &row->center[0],
                         &row->center[1],
                         &row->radius,
                         &row->programmed_radius,
                         &row->angle,
                         &row->value,
                         &row->length_min};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        *numbers[i] = take_number(bytes);
    }
    row->code = (int16_t)take_word(bytes);
    bool inside = take_byte(bytes) < 200;
    uint32_t at = inside && !in->pool_n ? 0 : take_word(bytes);
    row->pool =
        inside ? (in->pool_n ? at % (uint32_t)in->pool_n : 0) : at * 70000u;
    row->flags = take_word(bytes);
    row->plane = (uint8_t)(17 + take_byte(bytes) % 4);
    row->degree = take_byte(bytes) % 8;
    double speed = take_number(bytes);
    row->end_speed =
        fabs(speed) < 1e30 || !isfinite(speed) ? (float)speed : 1e30f;
    return true;
}

uint16_t fuzz_function_flags(const nc_block *row, bool standstill) {
    bool stops = row->type == NC_M && (row->code < 3 || row->code == 30);
    return standstill || stops ? NC_STANDSTILL : 0;
}

static bool function(struct rows_in *in, nc_block *row, uint8_t kind) {
    static const uint8_t types[] = {NC_M, NC_DWELL, NC_MARKER};
    begin(in, row, types[kind % 16 - 6]);
    uint8_t number = take_byte(&in->bytes);
    switch (row->type) {
    case NC_M:
        row->code = number % 40;
        row->flags = fuzz_function_flags(row, kind & 16);
        break;
    case NC_DWELL:
        row->value = number / 1000.0;
        break;
    default:
        row->code = 1 + number % 4;
        row->value = take_byte(&in->bytes);
        row->flags = kind & 16 ? NC_HAS_PARAM : 0;
    }
    return true;
}

bool fuzz_row(struct rows_in *in, nc_block *row) {
    uint8_t kind = take_byte(&in->bytes);
    switch (kind % 16) {
    case 0:
    case 1:
    case 2:
    case 3:
        return line(in, row, kind);
    case 4:
    case 5:
        return circle(in, row, kind);
    case 6:
    case 7:
    case 8:
        return function(in, row, kind);
    case 9:
        begin(in, row, kind & 16 ? NC_RT_LOOP_BEGIN : NC_RT_LOOP_END);
        row->flags = kind & 32 ? NC_MODULO : 0;
        return true;
    case 10:
        dynamics(in, row);
        return true;
    case 11:
        smoothing(in, row);
        return true;
    case 12:
        contour(in, row);
        return true;
    case 13:
        compensation(in, row, kind);
        return true;
    case 14:
        place(in, row, kind);
        return true;
    default:
        return raw(in, row);
    }
}
