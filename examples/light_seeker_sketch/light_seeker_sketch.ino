// A rover that answers lines of text (docs/robots/text-line.md).
//   "s"         ->  "300 512 700"   three light readings, 0..1023
//   "m 120 80"  ->  "ok"            left and right wheel, 0..255
// Without a line for half a second it stops by itself: the computer or the cable may have died.

const byte LIGHT[] = {A0, A1, A2};
const byte WHEEL[] = {5, 6};
const unsigned long SILENCE_MS = 500;

char line[24];
byte length = 0;
unsigned long heard_ms = 0;

void drive(long left, long right) {
  analogWrite(WHEEL[0], constrain(left, 0, 255));
  analogWrite(WHEEL[1], constrain(right, 0, 255));
}

void answer() {
  if (strcmp(line, "s") == 0) {
    for (byte i = 0; i < 3; i++) {
      Serial.print(analogRead(LIGHT[i]));
      Serial.print(i < 2 ? ' ' : '\n');
    }
    return;
  }
  char *rest;
  if (line[0] == 'm') {
    long left = strtol(line + 1, &rest, 10);
    char *first = rest;
    long right = strtol(rest, &rest, 10);
    if (first != line + 1 && rest != first && *rest == '\0') {
      drive(left, right);
      Serial.print("ok\n");
      return;
    }
  }
  Serial.print("what?\n");
}

void setup() {
  pinMode(WHEEL[0], OUTPUT);
  pinMode(WHEEL[1], OUTPUT);
  drive(0, 0);
  Serial.begin(115200);
}

void loop() {
  while (Serial.available()) {
    char c = Serial.read();
    if (c == '\n') {
      line[length] = '\0';
      length = 0;
      heard_ms = millis();
      answer();
    } else if (length < sizeof line - 1) {
      line[length++] = c;
    }
  }
  if (millis() - heard_ms > SILENCE_MS) drive(0, 0);
}
