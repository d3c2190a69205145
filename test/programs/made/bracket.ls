/PROG  BRACKET
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "upper seam";
PROG_SIZE	= 1132;
CREATE		= DATE 24-03-11  TIME 09:43:20;
MODIFIED	= DATE 24-03-11  TIME 11:02:44;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 12;
MEMORY_SIZE	= 1548;
PROTECT		= READ_WRITE;
TCD:  STACK_SIZE	= 0,
      TASK_PRIORITY	= 50,
      TIME_SLICE	= 0,
      BUSY_LAMP_OFF	= 0,
      ABORT_REQUEST	= 0,
      PAUSE_REQUEST	= 0;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/APPL
  ARC Welding : TRUE ;
/MN
   1:  !upper seam of the bracket ;
   2:  UFRAME_NUM=0 ;
   3:  UTOOL_NUM=1 ;
   4:J P[1:home] 20% FINE    ;
   5:L P[2] 100mm/sec FINE    ;
    :  Arc Start[1]    ;
   6:  WAIT    .30(sec) ;
   7:L P[3] 8mm/sec CNT100    ;
   8:C P[4]
    :  P[5] 8mm/sec CNT50    ;
   9:L P[6] WELD_SPEED FINE    ;
    :  Arc End[1]    ;
  10:  DO[5]=OFF ;
  11:  //L P[9] 100mm/sec FINE    ;
  12:L P[7] 240cm/min FINE    ;
  13:J P[1:home] 20% CNT100    ;
/POS
P[1:"home"]{
   GP1:
	UF : 0, UT : 1,	
	J1=     8.000 deg,	J2=    15.000 deg,	J3=   -10.000 deg,
	J4=     4.000 deg,	J5=   -75.000 deg,	J6=    -6.000 deg
};
P[2]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   994.487  mm,	Y =   115.951  mm,	Z =   267.525  mm,
	W =   176.587 deg,	P =    -5.350 deg,	R =     3.026 deg
};
P[3]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1114.487  mm,	Y =   115.951  mm,	Z =   267.525  mm,
	W =   176.587 deg,	P =    -5.350 deg,	R =     3.026 deg
};
P[4]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1144.487  mm,	Y =   145.951  mm,	Z =   267.525  mm,
	W =   176.587 deg,	P =    -5.350 deg,	R =     3.026 deg
};
P[5]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1114.487  mm,	Y =   175.951  mm,	Z =   267.525  mm,
	W =   176.587 deg,	P =    -5.350 deg,	R =     3.026 deg
};
P[6]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   994.487  mm,	Y =   175.951  mm,	Z =   267.525  mm,
	W =   176.587 deg,	P =    -5.350 deg,	R =     3.026 deg
};
P[7]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   994.487  mm,	Y =   175.951  mm,	Z =   367.525  mm,
	W =   176.587 deg,	P =    -5.350 deg,	R =     3.026 deg
};
/END
